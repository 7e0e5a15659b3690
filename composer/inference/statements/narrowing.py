"""Narrowing: what names stand for where a test came out true, or false."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Alternatives,
    Constant,
    Message,
    NodeValue,
    Value,
    is_none,
    join,
    truth_of,
)

if TYPE_CHECKING:
    from composer.inference.scopes import Scope

# The expressions that can be tried: they change nothing.
_PLAIN = (
    *(ast.Attribute, ast.BinOp, ast.BoolOp, ast.Compare, ast.Constant, ast.List, ast.Name),
    *(ast.Set, ast.Subscript, ast.Tuple, ast.UnaryOp),
    *(ast.expr_context, ast.boolop, ast.cmpop, ast.operator, ast.unaryop),
)
_PLAIN_CALLS = {'endswith', 'isinstance', 'len', 'startswith'}


class Narrowing(Part):
    """Uses what is known after a test."""

    def narrow(self, test: ast.expr, scope: Scope, outcome: Value, *, is_true: bool) -> None:
        """Keep of the names in a test only what they may stand for after it.

        Args:
            outcome: What the test may be.
        """
        self._narrow(test, scope, is_true=is_true)
        if truth_of(outcome) is None:
            self._try_alternatives(test, scope, is_true=is_true)
            doubt_rounds(test, scope)

    def _narrow(self, test: ast.expr, scope: Scope, *, is_true: bool) -> None:
        match test:
            case ast.UnaryOp(op=ast.Not()):
                self._narrow(test.operand, scope, is_true=not is_true)
            case ast.BoolOp():
                if isinstance(test.op, ast.And) == is_true:
                    for each in test.values:
                        self._narrow(each, scope, is_true=is_true)
            case ast.Name():
                self._drop_none(test, scope, has_value=is_true)
            case ast.Compare(
                left=ast.Name() as name, ops=[sign], comparators=[ast.Constant(None)]
            ):
                if isinstance(sign, ast.Is | ast.IsNot | ast.Eq | ast.NotEq):
                    is_none = isinstance(sign, ast.Is | ast.Eq)
                    self._drop_none(name, scope, has_value=is_none != is_true)
            case ast.Call(func=ast.Name(id=function), args=[ast.Name() as name, *_]):
                if function in ('isinstance', 'hasattr', 'callable', 'issubclass'):
                    with self._evaluator.run.silence():
                        is_known = truth_of(self._evaluator.evaluate(test, scope)) is not None
                    if not is_known:
                        self._forget(name, scope, is_true=is_true)
            case ast.Compare(left=ast.Call(func=ast.Name(id='type'), args=[ast.Name() as name])):
                self._forget(name, scope, is_true=True)

    def _drop_none(self, name: ast.Name, scope: Scope, *, has_value: bool) -> None:
        value = scope.names.get(name.id) if scope.names is not None else None
        if isinstance(value, Alternatives) and has_value:
            kept = [each for each in value.values if not is_none(each)]
            scope.set(name.id, join(kept) if kept else UNKNOWN)

    def _forget(self, name: ast.Name, scope: Scope, *, is_true: bool) -> None:
        """Forget what a name stands for, as the test of its type is not decided by that."""
        value = scope.names.get(name.id) if scope.names is not None else None
        is_sure = isinstance(value, NodeValue) or (isinstance(value, Message) and not is_true)
        if value is not None and not is_sure:
            scope.set(name.id, UNKNOWN)

    def _try_alternatives(self, test: ast.expr, scope: Scope, *, is_true: bool) -> None:
        """Drop the alternatives of each name with which the test comes out otherwise."""
        if scope.names is None or not all(map(_is_plain, ast.walk(test))):
            return
        for name in {each.id for each in ast.walk(test) if isinstance(each, ast.Name)}:
            value = scope.names.get(name)
            if not isinstance(value, Alternatives):
                continue
            kept: list[Value] = []
            for each in value.values:
                scope.names[name] = each
                with self._evaluator.run.silence():
                    truth = truth_of(self._evaluator.evaluate(test, scope))
                if truth in (None, is_true):
                    kept.append(each)
            is_less = 0 < len(kept) < len(value.values)
            scope.names[name] = join(kept) if is_less else value


def _is_plain(node: ast.AST) -> bool:
    if isinstance(node, ast.Call):
        name = getattr(node.func, 'id', None) or getattr(node.func, 'attr', None)
        return name in _PLAIN_CALLS and not node.keywords
    return isinstance(node, _PLAIN)


def doubt_rounds(test: ast.AST, scope: Scope) -> None:
    """Note that a condition which is not known decides which rounds of a loop are gone through.

    What the loop goes through is any of its items from then on; texts may be others as well.
    """
    used = {each.id for each in ast.walk(test) if isinstance(each, ast.Name)}
    for stored, targets in scope.looped:
        if scope.names is None or not stored & used:
            continue
        for name in stored:
            value = scope.names.get(name)
            if name in targets:
                scope.names[name] = targets[name]
            elif isinstance(value, Constant) and value.kind is str:
                scope.names[name] = Alternatives((value,))
