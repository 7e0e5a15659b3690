"""Comparisons in expressions that come out the same whatever the arguments are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jinja2 import nodes

from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.expressions.scope import Scope

_EQUALITIES = ('eq', 'ne')
_MEMBERSHIPS = ('in', 'notin')
_NUMBERS = (bool, int, float)


def find_useless_comparisons(
    expression: nodes.Expr, scope: Scope
) -> Iterator[tuple[str, str, str | None]]:
    """Yield each value that an argument never has: what is wrong, the value as text, and help."""
    found = [*expression.find_all(nodes.Compare)]
    for compare in [*found, *([expression] if isinstance(expression, nodes.Compare) else [])]:
        operand = compare.ops[0]
        sides = (compare.expr, operand.expr)
        for one, other in (sides, sides[::-1]) if operand.op in _EQUALITIES else ():
            yield from _compare(one, [other], scope)
        if operand.op in _MEMBERSHIPS and isinstance(operand.expr, nodes.List | nodes.Tuple):
            yield from _compare(compare.expr, operand.expr.items, scope)


def _compare(
    side: nodes.Node, others: list[nodes.Expr], scope: Scope
) -> Iterator[tuple[str, str, str | None]]:
    name = side.name if isinstance(side, nodes.Name) else ''
    if name not in scope.arguments or scope.values.get(name) is None:
        return
    value, choices = scope.values[name], scope.choices.get(name, ())
    for other in others:
        if isinstance(other, nodes.List | nodes.Tuple | nodes.Dict):
            yield f"'{name}' is {type(value).__name__}, and is never equal to a list", '', None
        if not isinstance(other, nodes.Const) or other.value is None:
            continue
        if _kind(value) != _kind(other.value):
            kinds = f'{type(value).__name__}, and is never equal to {other.value!r}'
            yield f"'{name}' is {kinds}", str(other.value), 'compare it with a value of its type'
        elif choices and other.value not in choices:
            text = f"'{name}' is never {other.value!r}"
            yield text, str(other.value), suggest(other.value, choices, 'its choices are')


def _kind(value: Any) -> type:
    return float if isinstance(value, _NUMBERS) else type(value)
