"""What behaviours do with messages, their node and its state can be done."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from composer.checks.behaviours.behaviour_functions import is_called_wrongly
from composer.checks.behaviours.shipped_behaviours import is_shipped
from composer.checks.parameters import OF_EVERY_NODE, find_refusal
from composer.checks.references import describe_missing_type
from composer.diagnostics import Related, diagnostic_at
from composer.entity_kinds import KIND_OF_NOUN, PUBLISHED, TYPE_FOLDERS
from composer.names import join_names
from composer.node_uses.message_uses import check_message_uses, find_problems
from composer.node_uses.reading import Problem, type_in
from composer.records import record
from composer.ros_parameters.parameter_types import find_type_problem
from composer.spelling import did_you_mean, find_nearest, is_typo, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.catalogue import InterfaceKind
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.node_uses.reading import Reading, RemoteParameter, Wire

_ASK = 'give it a default, or ask whether it is None'


def bound_at(context: CheckContext, binding: Binding) -> Related:
    """Return where the file names a behaviour, as another place of a finding."""
    return context.related_value(binding.behaviour.path, f'{binding.owner} is bound to it here')


def readings_of(context: CheckContext, node: NodeSpec) -> list[tuple[Binding, Reading]]:
    """Return the behaviours of a node that have no error of the file, and what they do."""
    return [
        (binding, context.behaviours.read(node, binding))
        for binding in context.bindings(node)
        if not context.was_dropped(binding.behaviour.path)
    ]


def check_bodies(context: CheckContext) -> Iterator[Diagnostic]:
    """Behaviours use fields, attributes and names of `node.state` that exist; each place once."""
    bound: dict[str, _Bindings] = {}
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            bindings = bound.setdefault(binding.behaviour.name, _Bindings())
            bindings.types.add(context.behaviours.wire_of(node, binding).given)
            bindings.nodes.add(node.key)
            bindings.is_for_something |= bool(getattr(binding.entity, 'publish', None))
            bindings.is_for_something |= binding.key.returned not in (None, PUBLISHED)
    found: dict[tuple[Span | None, str], Diagnostic] = {}
    # What was not read of a module is only known once all is read.
    read = [(node, readings_of(context, node)) for node in context.spec.nodes.values()]
    for node, readings in read:
        for binding, reading in readings:
            bindings = bound[binding.behaviour.name]
            for finding in _Body(context, node, binding, reading, readings, bindings).findings():
                found.setdefault((finding.span, finding.rule), finding)
    yield from found.values()


@dataclass(slots=True)
class _Bindings:
    """The types of messages that a behaviour is given, its nodes, and if its payloads are used."""

    types: set[str | None] = field(default_factory=set)
    nodes: set[str] = field(default_factory=set)
    is_for_something: bool = False


@record
class _Body:
    """A behaviour, the readings of all behaviours of its node, and where else it is bound to."""

    context: CheckContext
    node: NodeSpec
    binding: Binding
    reading: Reading
    readings: list[tuple[Binding, Reading]]
    bindings: _Bindings

    def findings(self) -> Iterator[Diagnostic]:
        context, behaviour = self.context, self.binding.behaviour
        is_own = not is_shipped(context, behaviour.module)
        for problem in self._problems(context.behaviours.wire_of(self.node, self.binding)):
            if is_own:
                related = [bound_at(context, self.binding), *problem.related]
                place, rule, advice = problem.place, problem.rule, problem.help
                yield diagnostic_at(place, rule, problem.message, help=advice, related=related)
            elif not is_called_wrongly(context, self.binding):
                # Its user cannot change what stands there.
                said = f"'{behaviour.name}' does not work here: {problem.message}"
                yield context.at_value(behaviour.path, problem.rule, said, help=problem.help)

    def _problems(self, wire: Wire) -> Iterator[Problem]:
        types, reading = self.context.types, self.reading
        returned = types.describe(wire.returned) if wire.returned else None
        for problem in reading.problems:
            if problem.rule != 'missing-return' or returned is None or returned.fields:
                yield problem
        # A behaviour that is given several types tells them apart in its own way.
        yield from check_message_uses(types, wire, reading, is_one=len(self.bindings.types) == 1)
        yield from self._values_needed()
        yield from self._state()
        yield from self._own_state()
        for remote in reading.remote_parameters:
            yield from self._remote_parameter(remote)
        yield from self._unpublished()
        if self.context.catalogue.available:
            yield from self._payloads(wire)
            yield from self._created()

    def _payloads(self, wire: Wire) -> Iterator[Problem]:
        """Check the payloads that are written out in the code."""
        context = self.context
        for sent in self.reading.payloads:
            if sent.section:
                type_name = type_in(self.node, sent.section, sent.name, context.has_real_type)
            else:
                type_name = getattr(wire, sent.name)
            if type_name is None:
                continue
            # Of several nodes, each may have another type under the name.
            is_certain = sent.is_certain or len(self.bindings.nodes) == 1
            full_name = f'{type_name}{sent.part}'
            for problem in find_problems(context.types, full_name, sent.value, sent.module):
                if is_certain or (problem.help or '').startswith('did you mean'):
                    yield problem

    def _values_needed(self) -> Iterator[Problem]:
        """Check what is unset at first, where nothing asks whether it has a value."""
        node = self.node
        is_open = self.binding.kind is None or any(each.is_state_open for _, each in self.readings)
        early = {
            name
            for binding, reading in self.readings
            for name in reading.state_set
            if binding.kind is None or binding.behaviour.class_name
        }
        for needed in self.reading.values_needed:
            text, name = '', needed.name
            if needed.of == 'parameters':
                parameter = node.parameters.get(name)
                is_null = parameter is not None and parameter.value is None and parameter.type
                if is_null and not (node.has_other_parameters or node.parameter_files):
                    text = f"the parameter '{name}' has no value until something sets it: "
                    text += 'this may be None'
            elif node.state.get(name, '') is None and not (is_open or name in early):
                told = f"'{name}' of the state is None until a behaviour sets it"
                text = told if all(map(node.state.get, needed.held)) else ''
            if text:
                yield Problem('no-value', text, needed.place, _ASK)

    def _unpublished(self) -> Iterator[Problem]:
        """Check that what timers and subscriptions give is for something, or other functions."""
        function = self.binding.behaviour.function
        if not self.reading.unpublished or self.bindings.is_for_something:
            return
        for module in self.reading.modules.values():
            for node in (inner for statement in module.body for inner in ast.walk(statement)):
                match node:
                    case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                        if name == function:
                            return
        text = f'nothing publishes this: {self.binding.owner} has no publish:'
        advice = "write 'publish:' beside 'behaviour:', or node.publish here"
        for place in self.reading.unpublished:
            yield Problem('no-effect', text, place, advice)

    def _created(self) -> Iterator[Problem]:
        """Check the types of entities that the behaviour creates."""
        catalogue = self.context.catalogue
        for created in self.reading.created:
            kind = KIND_OF_NOUN[created.kind].channel
            if created.type is None or created.type_place is None or kind is None:
                continue
            wanted = cast('InterfaceKind', TYPE_FOLDERS[kind])
            if re.fullmatch(rf'\w+/{wanted}/\w+', created.type) is None:
                last = re.split(r'\W', created.type)[-1]
                known = catalogue.names(wanted)
                meant = [name for name in known if name.rpartition('/')[2] == last]
                message, part = f"'{created.type}' is no {created.kind}'s type", created.type
                advice = did_you_mean(meant[0] if meant else None, f'write package/{wanted}/Name')
            elif catalogue.has(created.type):
                continue
            else:
                message, part, advice = describe_missing_type(self.context, created.type)
            yield Problem('unknown-type', message, created.type_place.narrowed_to(part), advice)

    def _state(self) -> Iterator[Problem]:
        """Check the names of `node.state`: something has to set those that are read."""
        node, readings = self.node, [reading for _, reading in self.readings]
        if any(reading.is_state_open for reading in readings):
            return
        if self.context.was_dropped((*node.path, 'state')):
            return
        mentions = self.context.behaviours.mentions(*readings)
        known = set(node.state).union(*(reading.state_set for reading in readings))
        tested = mentions.stored.union(*(reading.state_tested for reading in readings))
        used = tested.union(*({use.name for use in each.state_read} for each in readings))
        for name, place in self.reading.state_set.items():
            near = find_nearest(name, node.state)
            # One that is set for nobody may be meant to be a declared one.
            if near and is_typo(name, near) and name not in {*node.state, *used, *mentions.names}:
                text = f"'{name}' is set in the state, and nothing reads it"
                yield Problem('unknown-state', text, place, f"did you mean '{near}'?")
        for use in () if 'state' in mentions.open_kinds else self.reading.state_read:
            is_guarded = use.is_guarded and find_nearest(use.name, known) is None
            if use.name not in known and use.name not in tested and not is_guarded:
                text = f"neither 'state:' of node '{node.name}' nor a behaviour sets '{use.name}'"
                advice = suggest(use.name, known, 'there are', "declare it under 'state:'")
                yield Problem('unknown-state', text, use.place, advice)

    def _own_state(self) -> Iterator[Problem]:
        """Check the keys of `node.own_state` that are read: the behaviour has to set them."""
        owner = self.binding.own_state_of
        own = [reading for binding, reading in self.readings if binding.own_state_of == owner]
        mentions = self.context.behaviours.mentions(*own)
        known = mentions.stored.union(*(reading.own_state_set for reading in own))
        is_open = any(reading.is_own_state_open for reading in own)
        is_open |= 'own_state' in mentions.open_kinds
        for use in () if is_open else self.reading.own_state_read:
            if use.name not in known and not use.is_guarded:
                text = f"nothing sets '{use.name}' in the own_state of {self.binding.owner}"
                advice = suggest(use.name, known, 'there are', 'set it first, or read it by get')
                yield Problem('unknown-state', text, use.place, advice)

    def _remote_parameter(self, remote: RemoteParameter) -> Iterator[Problem]:
        """Check a parameter that is set or read by name, of a node of this system."""
        context, name = self.context, remote.node or self.node.name
        meant = name if name.startswith('/') else join_names(self.node.namespace, name)
        nodes = {node.full_name: node for node in context.spec.nodes.values()}
        target = nodes.get(meant)
        if target is None:
            yield from self._unknown_node(remote, meant, [*nodes])
            return
        parameter = target.parameters.get(remote.name)
        is_open = target.has_other_parameters or any(
            reading.reaches_ros for reading in context.readings(target)
        )
        if target.before_parameters_set is not None:
            return  # Nobody knows what it makes of it.
        if parameter is None and remote.name not in OF_EVERY_NODE and not is_open:
            text = f"node '{target.name}' declares no parameter '{remote.name}'"
            advice = suggest(remote.name, target.parameters, 'it declares')
            yield Problem('unknown-parameter', text, remote.place, advice)
        elif parameter is not None and (value := remote.value) is not None:
            reason = parameter.type and find_type_problem(value, parameter.type)
            reason = reason or (find_refusal(parameter, value) if parameter.type else None)
            if reason := 'it is read-only' if parameter.read_only else reason:
                text = f"parameter '{remote.name}' of node '{name}' refuses this: {reason}"
                related = (context.related(parameter.path, 'it is declared here'),)
                place = remote.value_place
                yield Problem('refused-parameter', text, place, None, related)

    def _unknown_node(
        self, remote: RemoteParameter, meant: str, names: list[str]
    ) -> Iterator[Problem]:
        """Report a node that the system may have under another name; others may be elsewhere."""
        last = meant.rpartition('/')[2]
        same = sorted(name for name in names if name.rpartition('/')[2] == last)
        nearest = same[0] if same else find_nearest(meant, names)
        # An external process may have a node of this name.
        processes = self.context.spec.processes.values()
        is_elsewhere = any((process.node_name or process.name) == last for process in processes)
        if nearest and not is_elsewhere and (same or is_typo(meant, nearest)):
            text = f"there is no node '{meant}' in this system"
            place = remote.node_place
            yield Problem('unknown-node', text, place, f"did you mean '{nearest}'?")
