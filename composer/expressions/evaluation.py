"""Expressions are walked, node by node, so that each step can be counted and bounded.

Compiled to Python, as jinja2 does it with templates, they would run as long as they like, and
compiling costs ten times what the walk does. The semantics are those of jinja2's compiler.
"""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

from jinja2 import StrictUndefined, TemplateAssertionError, nodes

from composer.expressions import limits
from composer.names import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from composer.expressions.sandbox import Sandbox


def evaluate_expression(
    expression: nodes.Expr, sandbox: Sandbox, values: Mapping[str, Any]
) -> Any:
    """Return the value of an expression; of undefined names it is jinja2's `Undefined`."""
    return _Walk(sandbox, values).value(expression)


class _Walk:
    def __init__(self, sandbox: Sandbox, values: Mapping[str, Any]) -> None:
        self.sandbox = sandbox
        self.values = values

    def value(self, node: nodes.Node) -> Any:
        handler = _HANDLERS.get(type(node))
        if handler is None:
            message = f'an expression has no {type(node).__name__} in it'
            raise TemplateAssertionError(message, node.lineno)
        self.sandbox.budget.spend()
        return handler(self, node)

    def counted(self, value: Any) -> Any:
        self.sandbox.budget.weigh(value)
        return value

    def arguments(self, node: Any) -> tuple[list[Any], dict[str, Any]]:
        positional = [self.value(each) for each in node.args]
        named = {each.key: self.value(each.value) for each in node.kwargs}
        if node.dyn_args is not None:
            positional += self.sandbox.budget.listed(self.value(node.dyn_args))
        if node.dyn_kwargs is not None:
            named |= self.value(node.dyn_kwargs)
        return positional, named


def _name(walk: _Walk, node: nodes.Name) -> Any:
    if node.name in walk.values:
        return walk.counted(walk.values[node.name])
    if node.name in walk.sandbox.globals:
        return walk.sandbox.globals[node.name]
    return walk.sandbox.undefined(name=node.name)


def _const(walk: _Walk, node: nodes.Const) -> Any:
    return walk.counted(node.value)


def _tuple(walk: _Walk, node: nodes.Tuple) -> Any:
    return walk.counted(tuple(map(walk.value, node.items)))


def _list(walk: _Walk, node: nodes.List) -> Any:
    return walk.counted(list(map(walk.value, node.items)))


def _dict(walk: _Walk, node: nodes.Dict) -> Any:
    return walk.counted({walk.value(pair.key): walk.value(pair.value) for pair in node.items})


def _condition(walk: _Walk, node: nodes.CondExpr) -> Any:
    if walk.value(node.test):
        return walk.value(node.expr1)
    if node.expr2 is not None:
        return walk.value(node.expr2)
    return walk.sandbox.undefined('the condition is false, and the expression has no else')


def _and(walk: _Walk, node: nodes.And) -> Any:
    return walk.value(node.left) and walk.value(node.right)


def _or(walk: _Walk, node: nodes.Or) -> Any:
    return walk.value(node.left) or walk.value(node.right)


def _concat(walk: _Walk, node: nodes.Concat) -> Any:
    parts = [walk.value(each) for each in node.nodes]
    walk.sandbox.budget.weigh(parts)
    return walk.counted(''.join(map(str, parts)))


def _compare(walk: _Walk, node: nodes.Compare) -> Any:
    left = walk.value(node.expr)
    holds: Any = True
    for operand in node.ops:
        right = walk.value(operand.expr)
        walk.sandbox.budget.weigh(left, right)
        holds = _COMPARISONS[operand.op](left, right)
        if not holds:
            break
        left = right
    return holds


def _unary(walk: _Walk, node: nodes.UnaryExpr) -> Any:
    return _UNARY[type(node)](walk.value(node.node))


def _binary(walk: _Walk, node: nodes.BinExpr) -> Any:
    left, right = walk.value(node.left), walk.value(node.right)
    if isinstance(node, nodes.Pow):
        limits.limit_power(left, right)
    elif isinstance(node, nodes.Mul):
        limits.limit_product(left, right)
    elif isinstance(node, nodes.Mod) and isinstance(left, str):
        limits.limit_percent_format(left, right)
    return walk.counted(_BINARY[type(node)](left, right))


def _attribute(walk: _Walk, node: nodes.Getattr) -> Any:
    owner = walk.value(node.node)
    method = walk.sandbox.method_of(owner, node.attr)
    return walk.sandbox.getattr(owner, node.attr) if method is None else method


def _item(walk: _Walk, node: nodes.Getitem) -> Any:
    owner = walk.value(node.node)
    return walk.counted(walk.sandbox.getitem(owner, walk.value(node.arg)))


def _slice(walk: _Walk, node: nodes.Slice) -> slice:
    ends = (node.start, node.stop, node.step)
    return slice(*(None if each is None else walk.value(each) for each in ends))


def _call(walk: _Walk, node: nodes.Call) -> Any:
    function = walk.value(node.node)
    positional, named = walk.arguments(node)
    for argument in (*positional, *named.values()):
        if isinstance(argument, StrictUndefined):
            str(argument)  # raises what is undefined, where functions would raise anything
    return walk.counted(walk.sandbox.call_function(function, positional, named))


def _filter(walk: _Walk, node: nodes.Filter) -> Any:
    if node.name not in walk.sandbox.filters:
        message = _unknown('filter', node.name, walk.sandbox.filters)
        raise TemplateAssertionError(message, node.lineno)
    value = walk.value(_operand(node))
    positional, named = walk.arguments(node)
    return walk.sandbox.call_filter(node.name, value, positional, named)


def _test(walk: _Walk, node: nodes.Test) -> Any:
    if node.name not in walk.sandbox.tests:
        message = _unknown('test', node.name, walk.sandbox.tests)
        raise TemplateAssertionError(message, node.lineno)
    value = walk.value(_operand(node))
    positional, named = walk.arguments(node)
    return walk.sandbox.call_test(node.name, value, positional, named)


def _unknown(what: str, name: str, known: Iterable[str]) -> str:
    near = suggest(name, known)
    hint = f" (did you mean '{near}'?)" if near else ''
    return f"there is no {what} '{name}'{hint}"


def _operand(node: nodes.Filter | nodes.Test) -> nodes.Expr:
    if node.node is None:
        message = 'a filter stands behind a value'
        raise TemplateAssertionError(message, node.lineno)
    return node.node


_COMPARISONS: dict[str, Callable[[Any, Any], Any]] = {
    'eq': operator.eq,
    'ne': operator.ne,
    'gt': operator.gt,
    'gteq': operator.ge,
    'lt': operator.lt,
    'lteq': operator.le,
    'in': lambda left, right: left in right,
    'notin': lambda left, right: left not in right,
}
_UNARY: dict[type, Callable[[Any], Any]] = {
    nodes.Not: operator.not_,
    nodes.Neg: operator.neg,
    nodes.Pos: operator.pos,
}
_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    nodes.Add: operator.add,
    nodes.Sub: operator.sub,
    nodes.Mul: operator.mul,
    nodes.Div: operator.truediv,
    nodes.FloorDiv: operator.floordiv,
    nodes.Mod: operator.mod,
    nodes.Pow: operator.pow,
}
_HANDLERS: dict[type, Callable[[_Walk, Any], Any]] = {
    nodes.Name: _name,
    nodes.Const: _const,
    nodes.Tuple: _tuple,
    nodes.List: _list,
    nodes.Dict: _dict,
    nodes.CondExpr: _condition,
    nodes.And: _and,
    nodes.Or: _or,
    nodes.Concat: _concat,
    nodes.Compare: _compare,
    nodes.Getattr: _attribute,
    nodes.Getitem: _item,
    nodes.Slice: _slice,
    nodes.Call: _call,
    nodes.Filter: _filter,
    nodes.Test: _test,
    **dict.fromkeys(_UNARY, _unary),
    **dict.fromkeys(_BINARY, _binary),
}
