"""Read behaviours: each once for all nodes that say the same of what it uses."""

from __future__ import annotations

import ast
import types
from collections import abc
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.inference.behaviour_results import check_results
from composer.inference.current_run import Run, TooLongError
from composer.inference.evaluation.evaluator import Evaluator, lasting
from composer.inference.message_types import MessageTypes
from composer.inference.module_names import ProjectModules, is_of_project
from composer.inference.node_facts import NodeFacts, Question
from composer.inference.reading import Reading, missing_reading, unknown_reading
from composer.inference.unread_code import Mentions, find_mentions
from composer.inference.values import (
    BY_FILE,
    BY_RUN,
    BY_STATE,
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Class,
    Function,
    Instance,
    Mapping,
    Message,
    Partial,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    constant,
    is_chosen,
    join,
    share,
)
from composer.inference.wires import Wire, wire_of
from composer.language.bindings import node_bindings
from composer.python_source.modules import ModuleSource

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.language.bindings import Binding
    from composer.language.specs import BehaviourSpec, EndSpec, NodeSpec
    from composer.python_source.module_finder import ModuleFinder
    from composer.yaml_text.positions import DataPath


# What all behaviours of a system may take: a step is a statement or an expression.
_MOST_STEPS = 200_000


class BehaviourReader:
    """Reads what behaviours do.

    Args:
        has_real_type: Whether the type of an entity is the one that is meant.
        names: The modules of all behaviours: each may change what another one reads.
    """

    def __init__(
        self,
        modules: ModuleFinder,
        catalogue: InterfaceCatalogue,
        has_real_type: Callable[[EndSpec], bool],
        names: abc.Iterable[str],
    ) -> None:
        self._finder = modules
        self._modules = ProjectModules(modules)
        for name in names:
            self._modules.find(name)
        self._types = MessageTypes(catalogue)
        self._has_real_type = has_real_type
        # By behaviour and what it is given: by questions, and by their answers.
        self._read: dict[object, dict[tuple[Question, ...], dict[object, Reading]]] = {}
        self._by_place: dict[DataPath, Reading] = {}
        self._wires: dict[DataPath, Wire] = {}
        self._read_once: dict[DataPath, Reading] = {}
        self._mentions: dict[int, Mentions] = {}
        self._steps_left = _MOST_STEPS

    def read(self, node: NodeSpec, binding: Binding) -> Reading:
        """Return what a behaviour does with its node."""
        place = binding.behaviour.path
        if place not in self._by_place:
            reading = self._read_first(node, binding)
            kept = self._kept_for(node, binding, reading) if reading.kept_read else {}
            if kept:
                needs_values = reading.needs_values
                reading = self._read_with(node, binding, tells_values=needs_values, kept=kept)
            self._by_place[place] = reading
        return self._by_place[place]

    def _read_first(self, node: NodeSpec, binding: Binding) -> Reading:
        """Return a reading that does not know what behaviours keep in the state."""
        place = binding.behaviour.path
        if place not in self._read_once:
            reading = self._read_with(node, binding, tells_values=False)
            if reading.needs_values:
                reading = self._read_with(node, binding, tells_values=True)
            self._read_once[place] = reading
        return self._read_once[place]

    def _kept_for(self, node: NodeSpec, binding: Binding, reader: Reading) -> dict[str, Value]:
        """Return what behaviours keep under the names in the state that one of them reads."""
        every = [(each, self._read_first(node, each)) for each in node_bindings(node)]
        owner = binding.own_state_of
        of_owner = [(each, reading) for each, reading in every if each.own_state_of == owner]
        found: dict[str, Value] = {}
        for name in sorted(reader.kept_read):
            is_own = name.startswith('[')
            keepers = of_owner if is_own else every
            readings = [reading for _, reading in keepers]
            is_open = any(
                each.is_own_state_open if is_own else each.is_state_open for each in readings
            )
            values = [each.kept[name] for each in readings if name in each.kept]
            first = constant(None if is_own else node.state.get(name))
            value = UNKNOWN if is_open else join(_widest([*values, lasting(first)]))
            is_moving = reader.needs_state and not is_open and _moves(name, keepers)
            if value not in (UNKNOWN, NONE) and not is_chosen(value):
                found[name] = join(_marked(each, is_moving) for each in alternatives(value))
            elif is_moving:
                found[name] = Unknown(BY_RUN)
        return found

    def _read_with(
        self,
        node: NodeSpec,
        binding: Binding,
        *,
        tells_values: bool,
        kept: abc.Mapping[str, Value] = types.MappingProxyType({}),
    ) -> Reading:
        """Return a reading that other nodes share if they answer alike."""
        facts = NodeFacts(node, self._has_real_type, tells_values, kept)
        wire = self.wire_of(node, binding)
        # With the wire, as nodes call their publishers differently.
        key = (binding.behaviour.name, wire, tells_values, _frozen(binding.behaviour.arguments))
        known = self._read.setdefault(key, {})
        for questions, readings in known.items():
            reading = readings.get(facts.answers(questions))
            if reading is not None:
                return reading
        reading = self._read_anew(binding, facts, wire)
        known.setdefault(tuple(facts.log), {})[tuple(facts.log.values())] = reading
        return reading

    def wire_of(self, node: NodeSpec, binding: Binding) -> Wire:
        """Return the types around a behaviour."""
        place = binding.behaviour.path
        if place not in self._wires:
            self._wires[place] = wire_of(binding, NodeFacts(node, self._has_real_type))
        return self._wires[place]

    def mentions(self, reading: Reading) -> Mentions:
        """Return what the modules of a behaviour may use beside what was read of it."""
        found = Mentions(set(reading.mentioned))
        for key, module in reading.modules.items():
            if key not in self._mentions:
                self._mentions[key] = find_mentions(module, self._modules.followed)
            found.names |= self._mentions[key].names
            found.open_kinds |= self._mentions[key].open_kinds
            found.attributes |= self._mentions[key].attributes
        return found

    def _read_anew(self, binding: Binding, facts: NodeFacts, wire: Wire) -> Reading:
        name = binding.behaviour.module
        module = self._finder.find(name)
        if not isinstance(module, ModuleSource):
            return missing_reading()
        if not is_of_project(module, name, self._finder):
            return unknown_reading()
        run = Run(facts, self._modules, self._types, self._steps_left)
        evaluator = Evaluator(run)
        try:
            _follow(evaluator, module, binding, wire)
        except (TooLongError, RecursionError):
            return unknown_reading()
        finally:
            self._steps_left -= run.steps
            # Its parts know it: it would keep all of this until garbage is collected.
            vars(evaluator).clear()
        run.reading.settle()
        run.reading.kept_read = {name for topic, name in facts.log if topic == 'kept'}
        return run.reading


def _widest(values: list[Value]) -> list[Value]:
    """Return what may be kept: who keeps a float where a whole number was finds either."""
    has_float = any(isinstance(each, Scalar) and each.kind is float for each in values)
    return [each for each in values if not (has_float and each == Scalar(int))]


def _marked(value: Value, is_moving: bool) -> Value:  # noqa: FBT001
    """Return what is kept as something on which the state decides."""
    chosen = BY_RUN if is_moving else BY_STATE
    return replace(value, is_chosen=chosen) if isinstance(value, Scalar) else value


def _moves(name: str, keepers: abc.Iterable[tuple[Binding, Reading]]) -> bool:
    """Return whether what is kept under a name changes while the system runs.

    What hooks of the node keep may tell which part the node plays.
    """
    kept = [(binding, reading) for binding, reading in keepers if name in reading.kept]
    return any(binding.entity is not None for binding, _ in kept) and not any(
        name in reading.kept_by_file for _, reading in kept
    )


def _follow(evaluator: Evaluator, module: ModuleSource, binding: Binding, wire: Wire) -> None:
    """Read a behaviour, and check the payloads that it gives away."""
    run, behaviour = evaluator.run, binding.behaviour
    if not run.modules.has_name(module, behaviour.class_name or behaviour.function):
        run.reading = missing_reading()
        return
    if behaviour.class_name:
        named = _method_of(evaluator, module, behaviour)
    else:
        named = evaluator.top_value(module, behaviour.function)
    function = _function_of(evaluator, named)
    if function is None:
        run.reading.open_all()
        return
    callee, bound = function
    place = Place(module, callee.definition)
    given: Value = UNKNOWN
    if wire.given:
        given = Message(wire.given, is_read_only=wire.is_read_only)
    if binding.parameters[-1] == 'changes':
        given = PartOfNode('changes')
    positional = [NODE, given][: len(binding.parameters)]
    constants = [(name, _of_file(value, place)) for name, value in behaviour.arguments.items()]
    arguments = Arguments(
        (*bound.positional, *(Argument(value, place) for value in positional)),
        (*bound.named, *((name, Argument(value, place)) for name, value in constants)),
    )
    callee.is_read = True
    if not evaluator.functions.fits(callee, arguments):
        _explain_call(run, module, binding, callee)
        run.reading.open_all()
        return
    scope = evaluator.functions.enter(callee, arguments, waits=True)
    check_results(evaluator, callee, scope, wire, binding)
    evaluator.payloads.report_unfit()
    evaluator.classes.mention_held()


def _method_of(evaluator: Evaluator, module: ModuleSource, behaviour: BehaviourSpec) -> Value:
    """Return the method of the object that the node has of a class; its making is read, too."""
    of = evaluator.top_value(module, behaviour.class_name)
    if not isinstance(of, Class):
        return UNKNOWN
    init = evaluator.classes.class_attribute(of, '__init__', Instance(of))
    place = Place(of.module, of.definition)
    node = Arguments((Argument(NODE, place),))
    takes_node = isinstance(init, Function) and evaluator.functions.fits(init, node)
    made = evaluator.classes.instantiate(of, node if takes_node else Arguments())
    if not isinstance(made, Instance):
        return UNKNOWN
    # All behaviours of the class have it.
    share(made)
    return evaluator.classes.class_attribute(of, behaviour.method_name, made) or UNKNOWN


def _explain_call(run: Run, module: ModuleSource, binding: Binding, callee: Function) -> None:
    """Report a call that does not fit, of what its name alone does not tell."""
    name = binding.behaviour.function
    source = module.find_function(name)
    if source is not None and source.signature is not None:
        # It has a finding at the name.
        return
    if module.is_open or run.modules.is_patched(name):
        # It may be another one by then.
        return
    place = Place(callee.module, callee.definition)
    if isinstance(callee.definition, ast.Lambda):
        shown = ast.unparse(callee.definition)
    else:
        shown = f'{callee.definition.name}({ast.unparse(callee.definition.args)})'
        for statement, _ in run.modules.top(module).statements.get(name, ()):
            if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value:
                place = Place(module, statement.value)
    run.report('bad-signature', place, f'{shown} is called as {binding.call}')


def _function_of(evaluator: Evaluator, value: Value) -> tuple[Function, Arguments] | None:
    """Return the function that a behaviour is, and the arguments that it has already."""
    match value:
        case Function():
            return value, Arguments()
        case Partial():
            inner = _function_of(evaluator, value.function)
            if inner is None or inner[1] != Arguments():
                return None
            return inner[0], value.arguments
        case Instance():
            method = evaluator.classes.class_attribute(value.of, '__call__', value)
            return (method, Arguments()) if isinstance(method, Function) else None
    return None


def _of_file(value: object, place: Place) -> Value:
    """Return the value of an argument under `with:`."""
    if isinstance(value, list | tuple):
        return Sequence([(_of_file(each, place), place) for each in value], list)
    if isinstance(value, abc.Mapping):
        return Mapping({key: (_of_file(each, place), place) for key, each in value.items()})
    if value is None or isinstance(value, bool | int | float | str):
        return constant(value, is_chosen=BY_FILE)
    return CHOSEN


def _frozen(value: object) -> object:
    """Return something that can be compared by a dictionary."""
    if isinstance(value, abc.Mapping):
        return tuple((key, _frozen(each)) for key, each in value.items())
    if isinstance(value, list | tuple):
        return tuple(map(_frozen, value))
    return (type(value), value)
