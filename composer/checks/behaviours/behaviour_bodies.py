"""What behaviours do with messages, their node and its state can be done."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, cast

from composer.checks.behaviours.behaviour_functions import is_called_wrongly
from composer.checks.behaviours.transforms import is_shipped
from composer.checks.parameters import OF_EVERY_NODE, find_refusal
from composer.checks.references import describe_missing_type
from composer.diagnostics import Related, diagnostic_at
from composer.entity_kinds import KIND_OF_NOUN, PUBLISHED, TYPE_FOLDERS
from composer.names import join_names
from composer.node_uses.literals import find_problems
from composer.node_uses.message_uses import check_message_uses
from composer.node_uses.reading import Problem
from composer.node_uses.wires import type_in
from composer.ros_parameters.parameter_types import find_type_problem
from composer.spelling import did_you_mean, find_nearest, is_typo, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.catalogue import InterfaceKind
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.node_uses.reading import Reading, RemoteParameter
    from composer.node_uses.wires import Wire
    from composer.python_source.modules import ModuleSource

_ASK = 'give it a default, or ask whether it is None'
Readings = list[tuple['Binding', 'Reading']]


def bound_at(context: CheckContext, binding: Binding) -> Related:
    """Return where the file names a behaviour, as another place of a finding."""
    return context.related_value(binding.behaviour.path, f'{binding.owner} is bound to it here')


def check_bodies(context: CheckContext) -> Iterator[Diagnostic]:
    """Behaviours use fields, attributes and names of `node.state` that exist; each place once."""
    found: dict[tuple[Span, str], Diagnostic] = {}
    used, given = _publishing_behaviours(context), _given_types(context)
    for node in context.spec.nodes.values():
        readings = [
            (binding, context.behaviours.read(node, binding))
            for binding in context.bindings(node)
            if not context.was_dropped(binding.behaviour.path)
        ]
        for finding in (
            *_explain_problems(context, node, readings, given),
            *_check_state(context, node, readings),
            *_check_own_state(context, readings),
            *_check_remote_parameters(context, node, readings),
            *_check_unpublished(context, readings, used),
            *_check_created(context, readings),
        ):
            if finding.span is not None:
                found.setdefault((finding.span, finding.rule), finding)
    yield from found.values()


def _given_types(context: CheckContext) -> dict[str, tuple[set[str | None], set[str]]]:
    """Return the types of messages that each behaviour is given, and the nodes it is bound to."""
    found: dict[str, tuple[set[str | None], set[str]]] = {}
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            wire = context.behaviours.wire_of(node, binding)
            types, nodes = found.setdefault(binding.behaviour.name, (set(), set()))
            types.add(wire.given)
            nodes.add(node.key)
    return found


def _explain_problems(
    context: CheckContext,
    node: NodeSpec,
    readings: Readings,
    given: dict[str, tuple[set[str | None], set[str]]],
) -> Iterator[Diagnostic]:
    for binding, reading in readings:
        wire = context.behaviours.wire_of(node, binding)
        # A behaviour that is given several types tells them apart in its own way.
        types, binders = given[binding.behaviour.name]
        problems = [
            *reading.problems,
            *_check_payloads(context, node, wire, reading, binders),
            *check_message_uses(context.types, wire, reading, is_one=len(types) == 1),
            *_check_parameters_needed(node, reading),
            *_check_states_needed(node, binding, reading, readings),
        ]
        returned = context.types.describe(wire.returned) if wire.returned else None
        for each in problems:
            if each.rule == 'missing-return' and returned and not returned.fields:
                continue
            if is_shipped(context, binding.behaviour.module):
                if is_called_wrongly(context, binding):
                    continue
                # Its user cannot change what stands there.
                said = f"'{binding.behaviour.name}' does not work here: {each.message}"
                yield context.at_value(binding.behaviour.path, each.rule, said, help=each.help)
                continue
            yield diagnostic_at(
                each.place,
                each.rule,
                each.message,
                help=each.help,
                related=[
                    bound_at(context, binding),
                ],
            )


def _check_payloads(
    context: CheckContext, node: NodeSpec, wire: Wire, reading: Reading, binders: set[str]
) -> Iterator[Problem]:
    """Check the payloads that are written out in the code."""
    for each in reading.payloads if context.catalogue.available else ():
        if each.section:
            type_name = type_in(node, each.section, each.name, context.has_real_type)
        else:
            type_name = getattr(wire, each.name)
        if type_name is None:
            continue
        # Of several nodes, each may have another type under the name.
        is_one = len(binders) == 1
        problems = find_problems(context.types, f'{type_name}{each.part}', each.value, each.module)
        for problem in problems:
            if is_one or each.is_certain or (problem.help or '').startswith('did you mean'):
                yield problem


def _check_parameters_needed(node: NodeSpec, reading: Reading) -> Iterator[Problem]:
    """Check that parameters have a value where nothing asks whether they have one."""
    if node.has_other_parameters or node.parameter_files:
        return
    for needed in reading.values_needed:
        parameter = node.parameters.get(needed.name) if needed.of == 'parameters' else None
        if parameter is not None and parameter.value is None and parameter.type is not None:
            text = f"the parameter '{needed.name}' has no value until something sets it"
            yield Problem('no-value', f'{text}: this may be None', needed.place, _ASK)


def _check_states_needed(
    node: NodeSpec, binding: Binding, reading: Reading, readings: Readings
) -> Iterator[Problem]:
    """Check likewise names of the state that are null at first, and that no start sets."""
    if binding.kind is None or any(each.is_state_open for _, each in readings):
        return
    early = {
        name
        for each, read in readings
        for name in read.state_set
        if each.kind is None or each.behaviour.class_name
    }
    for needed in reading.values_needed:
        is_null = needed.of == 'state' and node.state.get(needed.name, '') is None
        if is_null and needed.name not in early and all(map(node.state.get, needed.held)):
            text = f"'{needed.name}' of the state is None until a behaviour sets it"
            yield Problem('no-value', text, needed.place, _ASK)


def _publishing_behaviours(context: CheckContext) -> set[str]:
    """Return the behaviours of whose payloads something becomes somewhere."""
    return {
        binding.behaviour.name
        for node in context.spec.nodes.values()
        for binding in context.bindings(node)
        if getattr(binding.entity, 'publish', None)
        or binding.key.returned not in (None, PUBLISHED)
    }


def _check_unpublished(
    context: CheckContext, readings: Readings, used: set[str]
) -> Iterator[Diagnostic]:
    """Check that what timers and subscriptions give is for something, or for other functions."""
    for binding, reading in readings:
        function = binding.behaviour.function
        if not reading.unpublished or binding.behaviour.name in used:
            continue
        if any(_mentions(module, function) for module in reading.modules.values()):
            continue
        for place in reading.unpublished:
            yield diagnostic_at(
                place,
                'no-effect',
                f'nothing publishes this: {binding.owner} has no publish:',
                help="write 'publish:' beside 'behaviour:', or node.publish here",
                related=[bound_at(context, binding)],
            )


def _check_created(context: CheckContext, readings: Readings) -> Iterator[Diagnostic]:
    """Check the types of entities that behaviours create."""
    for binding, reading in readings if context.catalogue.available else ():
        for each in reading.created:
            kind = KIND_OF_NOUN[each.kind].channel
            if each.type is None or each.type_place is None or kind is None:
                continue
            wanted = cast('InterfaceKind', TYPE_FOLDERS[kind])
            if re.fullmatch(rf'\w+/{wanted}/\w+', each.type) is None:
                known = context.catalogue.names(wanted)
                last = re.split(r'\W', each.type)[-1]
                meant = [name for name in known if name.rpartition('/')[2] == last]
                message, part = f"'{each.type}' is no {each.kind}'s type", each.type
                advice = did_you_mean(meant[0] if meant else None, f'write package/{wanted}/Name')
            elif context.catalogue.has(each.type):
                continue
            else:
                message, part, advice = describe_missing_type(context, each.type)
            yield diagnostic_at(
                each.type_place.narrowed_to(part),
                'unknown-type',
                message,
                help=advice,
                related=[bound_at(context, binding)],
            )


def _mentions(module: ModuleSource, function: str) -> bool:
    """Return whether the code of a module uses a function."""
    for node in (each for statement in module.body for each in ast.walk(statement)):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                if name == function:
                    return True
    return False


def _check_state(
    context: CheckContext, node: NodeSpec, readings: Readings
) -> Iterator[Diagnostic]:
    """Check the names of `node.state` that are read: something has to set them."""
    if any(reading.is_state_open for _, reading in readings):
        return
    if context.was_dropped((*node.path, 'state')):
        return
    known = set(node.state).union(*(reading.state_set for _, reading in readings))
    tested = set().union(*(reading.state_tested for _, reading in readings))
    used = tested.union(*({use.name for use in reading.state_read} for _, reading in readings))
    for binding, reading in readings:
        yield from _check_stored(context, node, (binding, reading), used)
        for use in reading.state_read:
            if use.name in known or use.name in tested:
                continue
            if use.is_guarded and find_nearest(use.name, known) is None:
                continue
            yield diagnostic_at(
                use.place,
                'unknown-state',
                f"neither 'state:' of node '{node.name}' nor a behaviour sets '{use.name}'",
                help=suggest(use.name, known, 'there are', "declare it under 'state:'"),
                related=[bound_at(context, binding)],
            )


def _check_stored(
    context: CheckContext, node: NodeSpec, bound: tuple[Binding, Reading], used: set[str]
) -> Iterator[Diagnostic]:
    """Check names of `node.state` that are set for nobody: declared ones may be meant."""
    binding, reading = bound
    mentioned = context.behaviours.mentions(reading).attributes
    for name, place in reading.state_set.items():
        near = find_nearest(name, node.state)
        if name in node.state or name in used or near is None or not is_typo(name, near):
            continue
        if name not in mentioned:
            yield diagnostic_at(
                place,
                'unknown-state',
                f"'{name}' is set in the state, and nothing reads it",
                help=f"did you mean '{near}'?",
                related=[bound_at(context, binding)],
            )


def _check_own_state(context: CheckContext, readings: Readings) -> Iterator[Diagnostic]:
    """Check the keys of `node.own_state` that are read: the behaviour has to set them."""
    for owner in dict.fromkeys(binding.own_state_of for binding, _ in readings):
        own = [each for each in readings if each[0].own_state_of == owner]
        if any(reading.is_own_state_open for _, reading in own):
            continue
        known = set().union(*(reading.own_state_set for _, reading in own))
        for binding, reading in own:
            for use in reading.own_state_read:
                if use.name in known or use.is_guarded:
                    continue
                yield diagnostic_at(
                    use.place,
                    'unknown-state',
                    f"nothing sets '{use.name}' in the own_state of {binding.owner}",
                    help=suggest(use.name, known, 'there are', 'set it first, or read it by get'),
                    related=[bound_at(context, binding)],
                )


def _check_remote_parameters(
    context: CheckContext, node: NodeSpec, readings: Readings
) -> Iterator[Diagnostic]:
    """Check parameters that are set or read by name, of nodes of this system."""
    for binding, reading in readings:
        for each in reading.remote_parameters:
            target = _node_of_name(context, node, each.node)
            if target is None:
                yield from _explain_unknown_node(context, node, binding, each)
            elif target.before_parameters_set is not None:
                continue  # Nobody knows what it makes of it.
            elif parameter := target.parameters.get(each.name):
                yield from _explain_refusal(context, binding, each, parameter)
            elif each.name not in OF_EVERY_NODE and not _may_have_others(context, target):
                yield diagnostic_at(
                    each.place,
                    'unknown-parameter',
                    f"node '{target.name}' declares no parameter '{each.name}'",
                    help=suggest(each.name, target.parameters, 'it declares'),
                    related=[bound_at(context, binding)],
                )


def _explain_unknown_node(
    context: CheckContext, node: NodeSpec, binding: Binding, each: RemoteParameter
) -> Iterator[Diagnostic]:
    """Report a node that this system may have under another name; others may be elsewhere."""
    names = {other.full_name for other in context.spec.nodes.values()}
    meant = _full_name(node, each.node)
    same = sorted(name for name in names if name.rpartition('/')[2] == meant.rpartition('/')[2])
    nearest = same[0] if same else find_nearest(meant, names)
    if nearest and not same and not is_typo(meant, nearest):
        return
    if nearest is not None and not _is_in_process(context, meant):
        yield diagnostic_at(
            each.node_place,
            'unknown-node',
            f"there is no node '{meant}' in this system",
            help=f"did you mean '{nearest}'?",
            related=[bound_at(context, binding)],
        )


def _is_in_process(context: CheckContext, full_name: str) -> bool:
    """Return whether an external process may have a node of this name."""
    return any(
        process.node_name in (None, full_name.rpartition('/')[2])
        and (process.node_name or process.name) == full_name.rpartition('/')[2]
        for process in context.spec.processes.values()
    )


def _explain_refusal(
    context: CheckContext, binding: Binding, each: RemoteParameter, parameter: ParameterSpec
) -> Iterator[Diagnostic]:
    """Report a value that the node refuses."""
    reason = None
    if each.value is not None and parameter.type:
        value = each.value
        reason = find_type_problem(value, parameter.type) or find_refusal(parameter, value)
    if parameter.read_only and each.value is not None:
        reason = 'it is read-only'
    if reason is not None:
        yield diagnostic_at(
            each.value_place,
            'refused-parameter',
            f"parameter '{each.name}' of node '{each.node}' refuses this: {reason}",
            related=[
                bound_at(context, binding),
                context.related(parameter.path, 'it is declared here'),
            ],
        )


def _full_name(node: NodeSpec, name: str) -> str:
    return name if name.startswith('/') else join_names(node.namespace, name)


def _node_of_name(context: CheckContext, node: NodeSpec, name: str) -> NodeSpec | None:
    """Return the node that a name means, as `node.set_parameters` takes it."""
    full_name = _full_name(node, name)
    nodes = context.spec.nodes.values()
    return next((each for each in nodes if each.full_name == full_name), None)


def _may_have_others(context: CheckContext, node: NodeSpec) -> bool:
    return node.has_other_parameters or any(each.reaches_ros for each in context.readings(node))
