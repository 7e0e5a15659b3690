"""Evaluates expressions node by node, so that each step is counted and limited.

The semantics are those of jinja2's compiler. Compiled to Python, an expression could not be
limited: jinja2 lets `~`, comparisons, slices and literals run without asking its sandbox. Besides,
compiling takes five times as long as parsing and evaluating.
"""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

from jinja2 import StrictUndefined, TemplateAssertionError, UndefinedError, nodes

from composer.expressions import ARGUMENTS, limits
from composer.expressions.sandbox import too_deep
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.expressions.sandbox import Sandbox


class UnknownArgumentError(UndefinedError):
    """An expression asks for an argument that the file does not declare.

    Attributes:
        name: The argument.
    """

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no argument '{name}'")
        self.name = name


def evaluate_expression(sandbox: Sandbox, code: str, values: Mapping[str, Any]) -> Any:
    """Return the value of an expression; of undefined names it is jinja2's `Undefined`.

    Args:
        values: What is in scope, by name.

    Raises:
        TemplateError: It cannot be read, or does what is not allowed.
        Exception: Whatever its operators and methods raise.
    """
    sandbox.budget.begin()
    try:
        return Evaluator(sandbox, values).value(sandbox.parse_expression(code))
    except RecursionError:
        raise too_deep() from None


class Evaluator:
    """Evaluates the nodes of an expression, each by its row of a table."""

    def __init__(self, sandbox: Sandbox, values: Mapping[str, Any]) -> None:
        self.sandbox = sandbox
        self.values = values

    def value(self, node: nodes.Node | None) -> Any:
        """Return the value of any node."""
        evaluate = _NODES.get(type(node))
        if evaluate is None:
            message = f'an expression cannot contain a {type(node).__name__}'
            raise TemplateAssertionError(message, 1)
        value = evaluate(self, node)
        self.sandbox.budget.spend(*() if isinstance(node, _ALREADY_COUNTED) else (value,))
        return value

    def name(self, node: nodes.Name) -> Any:
        """Return what a name stands for."""
        for scope in (self.values, self.sandbox.globals):
            if node.name in scope:
                return scope[node.name]
        return self.sandbox.undefined(name=node.name)

    def condition(self, node: nodes.CondExpr) -> Any:
        """Return the value that a condition chooses."""
        if self.value(node.test):
            return self.value(node.expr1)
        if node.expr2 is not None:
            return self.value(node.expr2)
        return self.sandbox.undefined('the condition is false, and the expression has no else')

    def concatenation(self, node: nodes.Concat) -> str:
        """Return values as one text."""
        parts = [self.value(each) for each in node.nodes]
        self.sandbox.budget.spend(parts)
        return ''.join(map(str, parts))

    def comparison(self, node: nodes.Compare) -> Any:
        """Return whether a chain of comparisons holds."""
        left = self.value(node.expr)
        holds: Any = True
        for operand in node.ops:
            right = self.value(operand.expr)
            self.sandbox.budget.spend(left, right)
            holds = _COMPARISONS[operand.op](left, right)
            if not holds:
                break
            left = right
        return holds

    def binary(self, node: nodes.BinExpr) -> Any:
        """Apply an operator to two values."""
        left, right = self.value(node.left), self.value(node.right)
        if isinstance(node, nodes.Pow):
            limits.limit_power(left, right)
        elif isinstance(node, nodes.Mul):
            limits.limit_product(left, right)
        elif isinstance(node, nodes.Mod) and isinstance(left, str):
            limits.limit_percent_format(left, right)
        return _BINARY[type(node)](left, right)

    def item(self, node: nodes.Getitem) -> Any:
        """Return an item of a value.

        Raises:
            UnknownArgumentError: There is no such item in `args`.
        """
        owner, key = self.value(node.node), self.value(node.arg)
        is_argument = isinstance(node.node, nodes.Name) and node.node.name == ARGUMENTS
        if is_argument and isinstance(key, str) and key not in owner:
            raise UnknownArgumentError(key)
        return self.sandbox.getitem(owner, key)

    def slice(self, node: nodes.Slice) -> slice:
        """Return a part of a sequence as Python names it."""
        ends = (node.start, node.stop, node.step)
        return slice(*(None if each is None else self.value(each) for each in ends))

    def call(self, node: nodes.Call) -> Any:
        """Call a function or a method."""
        function = self.value(node.node)
        if isinstance(function, StrictUndefined):
            str(function)  # raises what is undefined
        positional, named = self.arguments(node)
        for argument in (*positional, *named.values()):
            if isinstance(argument, StrictUndefined):
                str(argument)  # raises what is undefined, where functions would raise anything
        return self.sandbox.call_function(function, positional, named)

    def filter_or_test(self, node: nodes.Filter | nodes.Test) -> Any:
        """Apply a filter or a test."""
        is_filter = isinstance(node, nodes.Filter)
        what, known = (
            ('filter', self.sandbox.filters) if is_filter else ('test', self.sandbox.tests)
        )
        if node.name not in known:
            advice = suggest(node.name, known)
            hint = f' ({advice})' if advice else ''
            message = f"there is no {what} '{node.name}'{hint}"
            raise TemplateAssertionError(message, node.lineno)
        apply = self.sandbox.call_filter if is_filter else self.sandbox.call_test
        return apply(node.name, self.value(node.node), *self.arguments(node))

    def arguments(self, node: Any) -> tuple[list[Any], dict[str, Any]]:
        """Return the positional and the named arguments of a call."""
        positional = [self.value(each) for each in node.args]
        named = {each.key: self.value(each.value) for each in node.kwargs}
        if node.dyn_args is not None:
            positional += self.sandbox.budget.collect(self.value(node.dyn_args))
        if node.dyn_kwargs is not None:
            named |= self.value(node.dyn_kwargs)
        return positional, named


# Their values were counted when they were made.
_ALREADY_COUNTED = (nodes.CondExpr, nodes.And, nodes.Or, nodes.Filter)
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
_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    nodes.Add: operator.add,
    nodes.Sub: operator.sub,
    nodes.Mul: operator.mul,
    nodes.Div: operator.truediv,
    nodes.FloorDiv: operator.floordiv,
    nodes.Mod: operator.mod,
    nodes.Pow: operator.pow,
}
_NODES: dict[type, Callable[[Evaluator, Any], Any]] = {
    nodes.Name: Evaluator.name,
    nodes.Const: lambda _, node: node.value,
    nodes.Tuple: lambda this, node: tuple(map(this.value, node.items)),
    nodes.List: lambda this, node: list(map(this.value, node.items)),
    nodes.Dict: lambda this, node: {
        this.value(pair.key): this.value(pair.value) for pair in node.items
    },
    nodes.CondExpr: Evaluator.condition,
    nodes.And: lambda this, node: this.value(node.left) and this.value(node.right),
    nodes.Or: lambda this, node: this.value(node.left) or this.value(node.right),
    nodes.Not: lambda this, node: not this.value(node.node),
    nodes.Neg: lambda this, node: -this.value(node.node),
    nodes.Pos: lambda this, node: +this.value(node.node),
    nodes.Concat: Evaluator.concatenation,
    nodes.Compare: Evaluator.comparison,
    nodes.Getattr: lambda this, node: this.sandbox.attribute(this.value(node.node), node.attr),
    nodes.Getitem: Evaluator.item,
    nodes.Slice: Evaluator.slice,
    nodes.Call: Evaluator.call,
    nodes.Filter: Evaluator.filter_or_test,
    nodes.Test: Evaluator.filter_or_test,
    **dict.fromkeys(_BINARY, Evaluator.binary),
}
