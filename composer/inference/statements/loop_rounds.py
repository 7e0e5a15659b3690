"""Loops and comprehensions: item by item where all items are known."""

from __future__ import annotations

import ast
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, TypeGuard

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Names, Scope, join_names, own_nodes
from composer.inference.values import (
    UNKNOWN,
    Alternatives,
    Class,
    Constant,
    Generated,
    Instance,
    Mapping,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    join,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# How many rounds are followed one by one: of a loop, and of all loops around a place.
_MOST_ROUNDS = 16
_MOST_NESTED = 48
_JUMPS = (ast.Break, ast.Continue)
_STORES = (ast.Attribute, ast.Subscript)
_ENDS = (ast.Return, ast.Raise)


class Loops(Part):
    """Follows loops, and the rounds of comprehensions."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._rounds = 1

    def items_of(self, iterated: Value) -> list[Value] | None:
        """Return what is gone through, item by item; `None` if that is unknown, or too much."""
        found: list[Value] = []
        match iterated:
            case Sequence() if iterated.is_whole:
                found = [value for value, _ in iterated.items]
            case Mapping() if not (iterated.is_open or iterated.is_lost):
                found = [constant(key) for key in iterated.entries]
            case Instance():
                found = self._evaluator.classes.fields.items_of(iterated) or []
            case Class() if self._evaluator.classes.enumerations.is_one(iterated):
                found = self._evaluator.classes.enumerations.members(iterated)
            case Generated(items=tuple(items)):
                found = list(items)
            case Constant(value=str(text)) if len(text) <= _MOST_ROUNDS:
                found = [constant(each, iterated.origin) for each in text]
        is_short = len(found) <= _MOST_ROUNDS and len(found) * self._rounds <= _MOST_NESTED
        return found if found and is_short else None

    def follow_for(self, node: ast.For | ast.AsyncFor, scope: Scope) -> None:
        """Follow a loop over something."""
        evaluator = self._evaluator
        iterated = evaluator.iterated(node.iter, scope, isinstance(node, ast.AsyncFor))
        is_plain = not any(isinstance(each, _STORES) for each in ast.walk(node.target))
        items = self.items_of(iterated) if is_plain else None
        with self._loop_in(node, scope):
            if items is not None:
                self._follow_each(node, scope, items)
                return
            item = evaluator.item_of(iterated)
            self._follow(node, scope, lambda: evaluator.statements.store(node.target, item, scope))

    def follow_while(self, node: ast.While, scope: Scope) -> None:
        """Follow a loop as long as a condition holds."""
        self._evaluator.waiting.poll(node, scope)
        self._evaluator.sleeping.spin(node, scope)

        def begin() -> None:
            test = self._evaluator.tested(node.test, scope)
            if truth_of(test) is False:
                scope.names = None
            else:
                self._evaluator.narrowing.narrow(node.test, scope, test, is_true=True)

        is_endless = isinstance(node.test, ast.Constant) and bool(node.test.value)
        with self._loop_in(node, scope):
            self._follow(node, scope, begin, is_endless=is_endless)

    @contextmanager
    def _loop_in(self, node: ast.For | ast.AsyncFor | ast.While, scope: Scope) -> Iterator[None]:
        """Keep the jumps of a loop apart, and forget at its end what they leave in doubt."""
        run = self._evaluator.run
        before = scope.broken, scope.continued
        standing = run.standing
        scope.broken, scope.continued = [], []
        yield
        scope.broken, scope.continued = before
        if not any(isinstance(each, _ENDS) for each in own_nodes(node)):
            run.standing = standing

    def _follow_each(self, node: ast.For | ast.AsyncFor, scope: Scope, items: list[Value]) -> None:
        """Follow a loop round by round."""
        jumps = any(isinstance(each, _JUMPS) for each in own_nodes(node))
        with self._rounds_of(node, items, scope):
            for item in items:
                if scope.names is None:
                    break
                scope.continued = []
                with self._evaluator.run.condition() if jumps else nullcontext():
                    self._evaluator.statements.store(node.target, item, scope)
                    self._evaluator.statements.follow_all(node.body, scope)
                scope.names = join_names([scope.names, *scope.continued])
        # What is looked for among known items is expected to be one of them.
        targets = {each.id for each in ast.walk(node.target) if _is_store(each)}
        read = {each.id for each in own_nodes(node) if isinstance(each, ast.Name)}
        is_search = bool(scope.broken and targets & read)
        with self._evaluator.run.condition(is_doubt=is_search):
            self._evaluator.statements.follow_all(node.orelse, scope)
        scope.names = join_names([scope.names, *scope.broken])

    @contextmanager
    def _rounds_of(
        self, loop: ast.For | ast.AsyncFor | ast.comprehension, items: list[Value], scope: Scope
    ) -> Iterator[None]:
        stored = {each.id for each in ast.walk(loop) if _is_store(each)}
        targets = {each.id for each in ast.walk(loop.target) if _is_store(each)}
        each_round: list[Names | None] = []
        for item in items:
            self._evaluator.statements.store(loop.target, item, scope)
            each_round.append(scope.copy_names())
        names = join_names(each_round) or {}
        any_round = {name: names.get(name, UNKNOWN) for name in targets}
        scope.looped.append((frozenset(stored), any_round))
        before, self._rounds = self._rounds, self._rounds * len(items)
        try:
            yield
        finally:
            self._rounds = before
            scope.looped.pop()

    def _follow(
        self,
        node: ast.For | ast.AsyncFor | ast.While,
        scope: Scope,
        begin: Callable[[], None],
        *,
        is_endless: bool = False,
    ) -> None:
        """Follow a loop twice: what the first round stores, the second one finds."""
        run, statements = self._evaluator.run, self._evaluator.statements
        before = scope.copy_names()
        with run.condition():
            with run.silence():
                begin()
                statements.follow_all(node.body, scope)
            after = join_names([before, scope.names, *scope.broken, *scope.continued])
            scope.names = _widened(before, after)
            again = scope.copy_names()
            scope.broken, scope.continued = [], []
            begin()
            statements.follow_all(node.body, scope)
        ends = [again, scope.names, *scope.continued]
        scope.names = None if is_endless else join_names(ends)
        statements.follow_all(node.orelse, scope)
        scope.names = join_names([scope.names, *scope.broken])

    # Comprehensions

    def rounds(
        self, generators: list[ast.comprehension], scope: Scope
    ) -> Iterator[tuple[Scope, bool]]:
        """Yield the scope of each round of a comprehension, and whether there is just this one.

        Each is followed on a condition, unless all items are known, and none is left out.
        """
        inner = Scope(scope.module, scope.function, outer=scope, waits=scope.waits)
        inner.looped = list(scope.looped)
        yield from self._rounds_in(generators, inner, is_certain=True)

    def _rounds_in(
        self, generators: list[ast.comprehension], scope: Scope, *, is_certain: bool
    ) -> Iterator[tuple[Scope, bool]]:
        if not generators:
            yield scope, is_certain
            return
        generator, *rest = generators
        evaluator = self._evaluator
        iterated = evaluator.iterated(generator.iter, scope, generator.is_async)
        names = {each.id for each in ast.walk(generator.target) if isinstance(each, ast.Name)}
        scope.local |= names
        items = self.items_of(iterated)
        is_certain = is_certain and items is not None
        several = [evaluator.item_of(iterated)] if items is None else items
        with self._rounds_of(generator, several, scope):
            for item in several:
                evaluator.statements.store(generator.target, item, scope)
                truths = [self._passes(test, scope) for test in generator.ifs]
                if False in truths and items is not None:
                    continue
                is_sure = is_certain and None not in truths
                with nullcontext() if is_sure else evaluator.run.condition():
                    yield from self._rounds_in(rest, scope, is_certain=is_sure)

    def _passes(self, test: ast.expr, scope: Scope) -> bool | None:
        outcome = self._evaluator.tested(test, scope)
        truth = truth_of(outcome)
        if truth is not False:
            self._evaluator.narrowing.narrow(test, scope, outcome, is_true=True)
        return truth


def _is_store(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)


def _widened(before: Names | None, after: Names | None) -> Names | None:
    """Return what names stand for in any round: what changes is more than the first two values."""
    if before is None or after is None:
        return after
    return {
        name: value if before.get(name) == value else _widen(value)
        for name, value in after.items()
    }


def _widen(value: Value) -> Value:
    if not isinstance(value, Alternatives):
        return value
    return join(
        Scalar(each.kind, each.is_chosen)
        if isinstance(each, Constant) and each.kind in (int, float, str)
        else each
        for each in alternatives(value)
    )
