"""Guards: what `try` and `with` catch of what goes wrong in them."""

from __future__ import annotations

import ast
from contextlib import ExitStack, nullcontext
from typing import cast

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Scope, join_names, own_nodes
from composer.inference.values import (
    UNKNOWN,
    Class,
    Function,
    Instance,
    Place,
    Scalar,
    Value,
    truth_of,
)

# What a wrong name raises, and what catches it.
_CATCHING = {
    'AttributeError',
    'ComposerError',
    'KeyError',
    'LookupError',
    'PayloadError',
    'TypeError',
    'UndeclaredError',
    'UndeclaredParameterError',
    'ValueError',
}
_CATCHING_PAYLOADS = {'ComposerError', 'PayloadError'}
_CATCHING_ALL = {'BaseException', 'Exception'}
# Statements of a handler that say that nothing is to be done.
_DOING_NOTHING = (ast.Pass, ast.Continue, ast.Return, ast.Break)


class Guards(Part):
    """Follows statements that may catch errors."""

    def follow_try(self, node: ast.Try, scope: Scope) -> None:
        """Follow `try`, and its handlers."""
        run = self._evaluator.run
        before = scope.copy_names()
        is_guard, is_broad = any(map(_is_guard, node.handlers)), any(map(_is_broad, node.handlers))
        tried = run.tried
        # It may be left before its end.
        doubt = run.condition() if node.handlers else nullcontext()
        kinds = (handler.type for handler in node.handlers if handler.type is not None)
        is_of_payloads = any(_names_in(kind) & _CATCHING_PAYLOADS for kind in kinds)
        guard = run.guard(is_guard=is_guard, is_broad=is_broad, is_of_payloads=is_of_payloads)
        with guard, doubt:
            self._evaluator.statements.follow_all(node.body, scope)
        after = scope.names
        if after is not None:
            # What is wrong in the body, and caught, never comes to this.
            with run.condition(is_doubt=is_guard):
                self._evaluator.statements.follow_all(node.orelse, scope)
        # Only then the file may decide whether it raises.
        is_doubtful = run.tried > tried
        ends = [scope.names]
        caught = join_names([before, after])
        for handler in node.handlers:
            scope.names = None if caught is None else dict(caught)
            kind: Value = (
                self._evaluator.evaluate(handler.type, scope) if handler.type else UNKNOWN
            )
            if handler.name:
                is_own = isinstance(kind, Class)
                error = Instance(cast('Class', kind), is_unmade=True) if is_own else None
                scope.set(handler.name, error or Scalar(Exception))
            is_doubt = is_doubtful and _is_guard(handler) and not _is_broad(handler)
            # What other types have is read where the type at hand never comes to.
            is_other = handler.type is not None and 'AttributeError' in _names_in(handler.type)
            with run.condition(is_doubt=is_doubt), run.of_other_types(is_other=is_other):
                self._evaluator.statements.follow_all(handler.body, scope)
            ends.append(scope.names)
        scope.names = join_names(ends)
        if node.finalbody:
            is_over = scope.names is None
            scope.names = caught if scope.names is None else scope.names
            self._evaluator.statements.follow_all(node.finalbody, scope)
            if is_over:
                scope.names = None

    def follow_with(self, node: ast.With | ast.AsyncWith, scope: Scope) -> None:
        """Follow `with`, and what its context managers do."""
        locks = ExitStack()
        managers: list[Value] = []
        is_guard = False
        is_of_payloads = any(
            _names_in(each.context_expr) & _CATCHING_PAYLOADS for each in node.items
        )
        for item in node.items:
            is_call = isinstance(item.context_expr, ast.Call) and isinstance(node, ast.AsyncWith)
            value = (
                self._evaluator.calls.call(item.context_expr, scope, is_awaited=True)
                if is_call
                else self._evaluator.evaluate(item.context_expr, scope)
            )
            managers.append(value)
            place = Place(scope.module, item.context_expr)
            locks.enter_context(self._evaluator.waiting.holding(value, place))
            entered = self._evaluator.entered(value)
            if item.optional_vars is not None:
                self._evaluator.statements.store(item.optional_vars, entered, scope)
            is_guard |= _suppresses(item.context_expr) or self._catches(item.context_expr, scope)
        before = scope.copy_names()
        # What objects do at the end of it, they do on whatever the body raises.
        results = [self._evaluator.left(each) for each in managers]
        is_guard |= any(each is not None and truth_of(each) is not False for each in results)
        with locks, self._evaluator.run.guard(is_guard=is_guard, is_of_payloads=is_of_payloads):
            self._evaluator.statements.follow_all(node.body, scope)
        if is_guard:
            scope.names = join_names([before, scope.names])

    def _catches(self, expression: ast.expr, scope: Scope) -> bool:
        """Return whether a generator that is a context manager catches what its body raises."""
        if not isinstance(expression, ast.Call):
            return False
        with self._evaluator.run.silence():
            function = self._evaluator.evaluate(expression.func, scope)
        if not isinstance(function, Function):
            return False
        tries = [node for node in own_nodes(function.definition) if isinstance(node, ast.Try)]
        handlers = [handler for node in tries for handler in node.handlers]
        return any(_is_guard(each) or _is_broad(each) for each in handlers)


def _is_guard(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler expects wrong names: it catches them, or ignores everything."""
    names = {'BaseException'} if handler.type is None else _names_in(handler.type)
    does_nothing = all(isinstance(each, _DOING_NOTHING) for each in handler.body)
    return bool(names & _CATCHING) or (does_nothing and bool(names & _CATCHING_ALL))


def _is_broad(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler catches everything, and goes on."""
    names = {'BaseException'} if handler.type is None else _names_in(handler.type)
    raises = any(isinstance(node, ast.Raise) for each in handler.body for node in ast.walk(each))
    return bool(names & _CATCHING_ALL) and not raises


def _suppresses(expression: ast.expr) -> bool:
    if not isinstance(expression, ast.Call) or not _names_in(expression.func) & {'suppress'}:
        return False
    caught = {name for argument in expression.args for name in _names_in(argument)}
    return bool(caught & (_CATCHING | _CATCHING_ALL))


def _names_in(expression: ast.expr) -> set[str]:
    """Return all names in an expression, those of attributes included."""
    nodes = list(ast.walk(expression))
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    return names | {node.attr for node in nodes if isinstance(node, ast.Attribute)}
