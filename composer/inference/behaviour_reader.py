"""Read behaviours: each once for all nodes that say the same of what it uses."""

from __future__ import annotations

import ast
from collections import abc
from typing import TYPE_CHECKING

from composer.inference.current_run import Run, TooLongError
from composer.inference.evaluation.evaluator import Evaluator
from composer.inference.message_types import MessageTypes
from composer.inference.module_names import ProjectModules, is_of_project
from composer.inference.node_facts import NodeFacts, Question
from composer.inference.reading import Reading, missing_reading, unknown_reading
from composer.inference.scopes import own_nodes
from composer.inference.unread_code import Mentions, find_mentions
from composer.inference.values import (
    BY_FILE,
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Constant,
    Function,
    Instance,
    Mapping,
    Message,
    Partial,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    is_none,
    join,
)
from composer.inference.wires import Wire, wire_of
from composer.python_source.modules import FunctionKind, ModuleSource

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.inference.scopes import Scope
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.language.bindings import Binding
    from composer.language.specs import EndSpec, NodeSpec
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.syntax import FunctionNode
    from composer.yaml_text.positions import DataPath


# What all behaviours of a system may take: a step is a statement or an expression.
_MOST_STEPS = 200_000
# What ends a loop; that a call may raise is no way to end one.
_WAYS_OUT = (ast.Break, ast.Return, ast.Raise)


class BehaviourReader:
    """Reads what behaviours do.

    Args:
        has_real_type: Whether the type of an entity is the one that is meant.
    """

    def __init__(
        self,
        modules: ModuleFinder,
        catalogue: InterfaceCatalogue,
        has_real_type: Callable[[EndSpec], bool],
    ) -> None:
        self._finder = modules
        self._modules = ProjectModules(modules)
        self._types = MessageTypes(catalogue)
        self._has_real_type = has_real_type
        # By behaviour and what it is given: by questions, and by their answers.
        self._read: dict[object, dict[tuple[Question, ...], dict[object, Reading]]] = {}
        self._by_place: dict[DataPath, Reading] = {}
        self._wires: dict[DataPath, Wire] = {}
        self._mentions: dict[int, Mentions] = {}
        self._steps_left = _MOST_STEPS

    def read(self, node: NodeSpec, binding: Binding) -> Reading:
        """Return what a behaviour does with its node."""
        place = binding.behaviour.path
        if place not in self._by_place:
            reading = self._read_with(node, binding, tells_values=False)
            if reading.needs_values:
                reading = self._read_with(node, binding, tells_values=True)
            self._by_place[place] = reading
        return self._by_place[place]

    def _read_with(self, node: NodeSpec, binding: Binding, *, tells_values: bool) -> Reading:
        """Return a reading that other nodes share if they answer alike."""
        facts = NodeFacts(node, self._has_real_type, tells_values)
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
        return found

    def _read_anew(self, binding: Binding, facts: NodeFacts, wire: Wire) -> Reading:
        module = self._finder.find(binding.behaviour.module)
        if not isinstance(module, ModuleSource):
            return missing_reading()
        if not is_of_project(module):
            return unknown_reading()
        self._modules.find(binding.behaviour.module)
        run = Run(facts, self._modules, self._types, self._steps_left)
        try:
            _follow(run, module, binding, wire)
        except (TooLongError, RecursionError):
            return unknown_reading()
        finally:
            self._steps_left -= run.steps
        run.reading.settle()
        return run.reading


def _follow(run: Run, module: ModuleSource, binding: Binding, wire: Wire) -> None:
    """Read a behaviour, and check the payloads that it gives away."""
    evaluator = Evaluator(run)
    behaviour = binding.behaviour
    if not run.modules.has_name(module, behaviour.function):
        run.reading = missing_reading()
        return
    function = _function_of(evaluator, evaluator.top_value(module, behaviour.function))
    if function is None:
        run.reading.open_all()
        return
    callee, bound = function
    place = Place(module, callee.definition)
    given: Value = Message(wire.given) if wire.given else UNKNOWN
    if binding.key.key == 'on_parameters':
        given = PartOfNode('changes')
    positional = [NODE, given][: len(binding.parameters)]
    named = [(name, _of_file(value, place)) for name, value in behaviour.arguments.items()]
    arguments = Arguments(
        (*bound.positional, *(Argument(value, place) for value in positional)),
        (*bound.named, *((name, Argument(value, place)) for name, value in named)),
    )
    callee.is_read = True
    if not evaluator.functions.fits(callee, arguments):
        if isinstance(callee.definition, ast.Lambda):
            shown = ast.unparse(callee.definition)
            run.report('bad-signature', place, f'{shown} is called as {binding.call}')
        run.reading.open_all()
        return
    scope = evaluator.functions.enter(callee, arguments, waits=True)
    _check_payloads(evaluator, callee, scope, wire)
    _check_answers(evaluator, scope, binding)
    _check_end(evaluator, callee, binding)
    evaluator.payloads.report_unfit()


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


def _check_payloads(evaluator: Evaluator, callee: Function, scope: Scope, wire: Wire) -> None:
    kind = evaluator.functions.kind_of(callee)
    is_generator = kind.is_generator
    returned = wire.ended if is_generator else wire.returned
    if kind is FunctionKind.ASYNC_GENERATOR and wire.ended:
        # The last one that it yields is the result.
        for value, place in scope.yielded:
            if not evaluator.payloads.fits(wire.ended, value, place):
                _check(evaluator, wire.yielded, value, place)
        return
    for value, place in scope.yielded if is_generator else ():
        _check(evaluator, wire.yielded, value, place)
    for value, place in scope.returned:
        with evaluator.run.condition(is_doubt=id(place.node) in scope.doubtful):
            _check(evaluator, returned, value, place)
    nothing = all(is_none(value) for value, _ in scope.returned)
    nothing = nothing and not is_generator and not _is_stub(callee.definition)
    if wire.needs_payload and wire.returned and scope.returned and nothing:
        _, place = scope.returned[-1]
        evaluator.payloads.check(wire.returned, NONE, place)


def _is_stub(definition: FunctionNode | ast.Lambda) -> bool:
    """Return whether a function is still to be written: it has a docstring, `...` or `pass`."""
    body = definition.body if isinstance(definition.body, list) else []
    plain = (each.value if isinstance(each, ast.Expr) else each for each in body)
    return all(isinstance(each, ast.Constant | ast.Pass) for each in plain)


def _check_end(evaluator: Evaluator, callee: Function, binding: Binding) -> None:
    """Check that a behaviour ends: until then nothing else of its group runs."""
    kind, definition = evaluator.functions.kind_of(callee), callee.definition
    # Goals have threads of their own.
    is_of_action = binding.kind is not None and binding.kind.channel == 'action'
    if kind is not FunctionKind.PLAIN or is_of_action or isinstance(definition, ast.Lambda):
        return
    for loop in own_nodes(definition):
        if isinstance(loop, ast.While) and _is_endless(loop):
            place = Place(callee.module, loop.test)
            text = 'this loop never ends, and nothing else of its callback group runs again'
            evaluator.run.report('endless-loop', place, text, 'let a timer call the behaviour')


def _is_endless(loop: ast.While) -> bool:
    is_always_true = isinstance(loop.test, ast.Constant) and bool(loop.test.value)
    return is_always_true and not any(isinstance(node, _WAYS_OUT) for node in own_nodes(loop))


def _check_answers(evaluator: Evaluator, scope: Scope, binding: Binding) -> None:
    """Check what `accept` and `on_parameters` return: whether, or why not."""
    kinds: dict[str, tuple[type, ...]] = {
        'accept': (bool, str, type(None)),
        'on_parameters': (str, type(None)),
    }
    wanted = kinds.get(binding.key.key)
    for value, place in scope.returned if wanted else ():
        several = alternatives(value)
        found = [each.kind for each in several if isinstance(each, Constant | Scalar | Sequence)]
        if wanted and len(found) == len(several) and not set(found) & set(wanted):
            what = 'whether to accept, or why not' if bool in wanted else 'None, or why not'
            evaluator.run.report(
                'bad-answer',
                place,
                f'{binding.owner} returns a {found[0].__name__}',
                f'return {what}',
            )


def _check(evaluator: Evaluator, type_name: str | None, value: Value, place: Place) -> None:
    """Check a payload; none is published for `None`."""
    several = [each for each in alternatives(value) if not is_none(each)]
    if several:
        evaluator.payloads.check(type_name, join(several), place)


def _frozen(value: object) -> object:
    """Return something that can be compared by a dictionary."""
    if isinstance(value, abc.Mapping):
        return tuple((key, _frozen(each)) for key, each in value.items())
    if isinstance(value, list | tuple):
        return tuple(map(_frozen, value))
    return (type(value), value)
