"""What behaviours give away: payloads, answers, and whether they come to an end."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.entity_kinds import TRANSITION_BEHAVIOURS
from composer.inference.current_run import span_of
from composer.inference.message_types import in_python
from composer.inference.scopes import own_nodes
from composer.inference.values import (
    NONE,
    Constant,
    External,
    Function,
    Mapping,
    Message,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    is_none,
    join,
)
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.return_values import ends_without_value, never_returns

if TYPE_CHECKING:
    from composer.inference.evaluation.evaluator import Evaluator
    from composer.inference.scopes import Scope
    from composer.inference.wires import Wire
    from composer.language.bindings import Binding
    from composer.python_source.syntax import FunctionNode

# What ends a loop; that a call may raise is no way to end one.
_WANTED = {'accept': 'whether to accept, or why not', 'on_parameters': 'None, or why not'}
_WAYS_OUT = (ast.Break, ast.Return, ast.Raise)


def check_results(
    evaluator: Evaluator, callee: Function, scope: Scope, wire: Wire, binding: Binding
) -> None:
    """Check what a behaviour gives away, and that it comes to an end."""
    _check_payloads(evaluator, callee, scope, wire, binding)
    _check_answers(evaluator, scope, binding)
    _note_unpublished(evaluator, scope, wire)
    _check_end(evaluator, callee, binding)


def _check_payloads(
    evaluator: Evaluator, callee: Function, scope: Scope, wire: Wire, binding: Binding
) -> None:
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
    is_allowed = binding.may_yield or not is_generator
    if wire.needs_payload and is_allowed and not _is_stub(callee.definition):
        _check_ways(evaluator, callee, scope, returned)


def _check_ways(
    evaluator: Evaluator, callee: Function, scope: Scope, returned: str | None
) -> None:
    """Check that all ways through a behaviour give the response or result that is waited for."""
    definition = callee.definition
    doubtful = [
        place
        for value, place in scope.returned
        if isinstance(place.node, ast.Call) and any(map(is_none, alternatives(value)))
    ]

    def is_last(call: ast.Call) -> bool:
        with evaluator.run.silence():
            called = evaluator.evaluate(call.func, scope)
        return (
            isinstance(called, Function)
            and not isinstance(called.definition, ast.Lambda)
            and never_returns(called.definition)
        )

    ends = [] if isinstance(definition, ast.Lambda) else ends_without_value(definition, is_last)
    nothing = [place for value, place in scope.returned if is_none(value)]
    certain = [
        place
        for place in nothing
        if id(place.node) not in scope.doubtful
        and (place.node in ends or isinstance(place.node, ast.Attribute | ast.Call | ast.Name))
    ]
    doubtful += [Place(callee.module, definition)] if ends else []
    for place in certain:
        evaluator.payloads.check(returned, NONE, place)
    if doubtful and not certain:
        # What decides it may change while the system runs.
        text = 'some ways through this function return nothing, and the caller gets an error'
        evaluator.run.report('missing-return', doubtful[0], text, 'return something at its end')


def _note_unpublished(evaluator: Evaluator, scope: Scope, wire: Wire) -> None:
    """Note payloads that nothing publishes: dictionaries and messages made by the behaviour."""
    for value, place in (*scope.returned, *scope.yielded) if wire.is_unpublished else ():
        several = alternatives(value)
        is_payload = all(isinstance(each, Mapping | Message) for each in several)
        if is_payload and _is_made_there(place.node):
            evaluator.run.reading.unpublished.append(span_of(place))


def _is_made_there(node: ast.AST) -> bool:
    """Return whether an expression is a dictionary, or makes an object of a class."""
    called = node.func if isinstance(node, ast.Call) else None
    name = str(getattr(called, 'id', None) or getattr(called, 'attr', ''))
    return isinstance(node, ast.Dict) or name[:1].isupper()


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
    """Check what `accept`, `on_parameters` and transitions return: whether, or why not."""
    kinds: dict[str, tuple[type, ...]] = {
        **dict.fromkeys(TRANSITION_BEHAVIOURS, (bool, type(None))),
        'accept': (bool, str, type(None)),
        'on_parameters': (str, type(None)),
    }
    wanted = kinds.get(binding.key.key)
    for value, place in scope.returned if wanted else ():
        several = alternatives(value)
        found = list(filter(None, map(_kind_name, several)))
        names = {each.__name__ for each in wanted or ()}
        if wanted and len(found) == len(several) and not names & set(found):
            what = _WANTED.get(binding.key.key, 'False if it failed, or nothing')
            evaluator.run.report(
                'bad-answer',
                place,
                f'{binding.owner} returns a {found[0]}',
                f'return {what}',
            )


def _kind_name(value: Value) -> str:
    """Return the name of the type of what is no object of the project; empty if not known."""
    match value:
        case Constant() | Scalar() | Sequence():
            return value.kind.__name__
        case Message():
            return in_python(value.type)
        case Mapping():
            return 'dict'
        case External(name=name) if name.startswith('rclpy.'):
            # A member of an enumeration, such as `GoalResponse.REJECT`.
            return name.rpartition('.')[0].rpartition('.')[2]
    return ''


def _check(evaluator: Evaluator, type_name: str | None, value: Value, place: Place) -> None:
    """Check a payload; none is published for `None`."""
    several = [each for each in alternatives(value) if not is_none(each)]
    if several:
        evaluator.payloads.check(type_name, join(several, like=value), place)
