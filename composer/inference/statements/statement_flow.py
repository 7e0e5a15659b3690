"""Statements: what they store, and on which conditions they are reached."""

from __future__ import annotations

import ast
from contextlib import ExitStack
from typing import TYPE_CHECKING

from composer.inference.evaluation.operators import combine
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.waiting import THREAD
from composer.inference.message_types import item_of
from composer.inference.scopes import Names, Scope, join_names
from composer.inference.values import (
    BY_STATE,
    NEVER,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    ArrayField,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    Function,
    Generated,
    Held,
    Mapping,
    NodeValue,
    PartOfNode,
    Place,
    Primitive,
    Scalar,
    Sequence,
    Value,
    alternatives,
    is_chosen,
    join,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable
    from collections.abc import Sequence as SequenceOf


_WITHOUT_EFFECT = (ast.Name, ast.Dict, ast.Compare, ast.BinOp, ast.Tuple, ast.List)


class Statements(Part):
    """Follows statements."""

    def follow_all(self, statements: Iterable[ast.stmt], scope: Scope) -> None:
        """Follow statements, as far as they are reached."""
        for statement in statements:
            if scope.names is None:
                return
            self._evaluator.run.step()
            method = getattr(self, f'_{type(statement).__name__.lower()}', None)
            if method is not None:
                method(statement, scope)

    # Stores

    def store(self, target: ast.expr, value: Value, scope: Scope) -> None:
        """Store a value, in a name or in something."""
        match target:
            case ast.Name():
                if scope.function is not None and target.id not in scope.local:
                    self._evaluator.waiting.fill(Held(str(scope.module.path), target.id))
                scope.set(target.id, value)
            case ast.Starred():
                self.store(target.value, UNKNOWN, scope)
            case ast.Tuple() | ast.List():
                place = Place(scope.module, target)
                self._evaluator.refuse(place, iter, value)
                parts = self._parts(value, target.elts, place)
                for each, part in zip(target.elts, parts, strict=True):
                    self.store(each, part, scope)
            case ast.Attribute():
                owner = self._evaluator.evaluate(target.value, scope)
                place = Place(scope.module, target)
                self._evaluator.attributes.store(owner, target.attr, value, place)
            case ast.Subscript():
                self._store_item(target, value, scope)

    def _parts(self, value: Value, targets: SequenceOf[ast.expr], place: Place) -> list[Value]:
        """Return what each target gets of something that is unpacked."""
        starred = any(isinstance(each, ast.Starred) for each in targets)
        several = alternatives(value)
        rows = [
            [item for item, _ in each.items]
            for each in several
            if isinstance(each, Sequence) and each.is_whole
        ]
        rows += [
            [item_of(each)] * (each.type.array_bound or 0)
            for each in several
            if isinstance(each, ArrayField) and each.type.array == 'fixed'
        ]
        if len(rows) == len(several) and not starred:
            fitting = [row for row in rows if len(row) == len(targets)]
            if fitting == rows:
                return [join(column) for column in zip(*rows, strict=True)]
            if not fitting:
                text = f'this takes {len(targets)} values, and there are {len(rows[0])}'
                self._evaluator.run.report('bad-index', place, text)
        return [self._evaluator.item_of(value)] * len(targets)

    def _store_item(self, target: ast.Subscript, value: Value, scope: Scope) -> None:
        owner = self._evaluator.evaluate(target.value, scope)
        index = self._evaluator.evaluate(target.slice, scope)
        self._evaluator.read_only.check_write(owner, Place(scope.module, target))
        self._evaluator.containers.store_item(
            owner, index, value, Place(scope.module, target.slice)
        )

    def _assign(self, node: ast.Assign, scope: Scope) -> None:
        value = self._evaluator.evaluate(node.value, scope)
        if isinstance(value, Awaitable):
            self._check_kept(node, scope)
        for target in node.targets:
            self.store(target, value, scope)

    def _check_kept(self, node: ast.Assign, scope: Scope) -> None:
        """Report a coroutine that is kept under a name that nothing uses."""
        match node.targets:
            case [ast.Name(id=name)] if scope.function and name in scope.local:
                uses = (
                    isinstance(each, ast.Name)
                    and each.id == name
                    and isinstance(each.ctx, ast.Load)
                    for each in ast.walk(scope.function.definition)
                )
                if not any(uses):
                    text = f"'{name}' is a coroutine that is never awaited, so it never runs"
                    place = Place(scope.module, node.value)
                    self._evaluator.run.report('missing-await', place, text, 'put await before it')

    def _annassign(self, node: ast.AnnAssign, scope: Scope) -> None:
        if node.value is not None:
            self.store(node.target, self._evaluator.evaluate(node.value, scope), scope)

    def _augassign(self, node: ast.AugAssign, scope: Scope) -> None:
        value = self._evaluator.evaluate(node.value, scope)
        before = self._evaluator.read_target(node.target, scope)
        place = Place(scope.module, node.value)
        if getattr(before, 'kind', None) is not list:
            # A list takes anything that can be gone through.
            self._evaluator.expressions.check_operands(node.op, before, value, place)
        if isinstance(node.target, ast.Name):
            # Arrays are changed in place.
            self._evaluator.read_only.check_write(before, Place(scope.module, node.target))
        if isinstance(node.target, ast.Attribute):
            owner = self._evaluator.evaluate(node.target.value, scope)
            if owner == PartOfNode('state'):
                self._evaluator.keep(node.target.attr, combine(node.op, value, value))
                self._evaluator.waiting.fill(Held('state', node.target.attr))
                return
        if isinstance(node.target, ast.Subscript):
            owner = self._evaluator.evaluate(node.target.value, scope)
            if owner == PartOfNode('own_state'):
                index = self._evaluator.evaluate(node.target.slice, scope)
                for each in alternatives(index):
                    if isinstance(each, Constant):
                        self._evaluator.keep(f'[{each.value}]', combine(node.op, value, value))
                return
        is_union = isinstance(node.op, ast.BitOr)
        if isinstance(before, Mapping) and isinstance(value, Mapping) and is_union:
            place = Place(scope.module, node.value)
            self._evaluator.containers.update_mapping(before, value, place)
            return
        if isinstance(before, Sequence):
            self._evaluator.containers.extend(before, value, Place(scope.module, node.value))
            return
        self.store(node.target, combine(node.op, before, value), scope)

    def _delete(self, node: ast.Delete, scope: Scope) -> None:
        for target in node.targets:
            if isinstance(target, ast.Name):
                scope.set(target.id, UNKNOWN)
            elif isinstance(target, ast.Subscript):
                self._delete_item(target, scope)
            elif isinstance(target, ast.Attribute):
                self._evaluator.evaluate(target, scope)

    def _delete_item(self, target: ast.Subscript, scope: Scope) -> None:
        self._evaluator.read_target(target, scope)
        owner = self._evaluator.evaluate(target.value, scope)
        self._evaluator.read_only.check_write(owner, Place(scope.module, target))
        with self._evaluator.run.silence():
            index = self._evaluator.evaluate(target.slice, scope)
        if isinstance(owner, Mapping | Sequence) and isinstance(index, Constant):
            given = Argument(index, Place(scope.module, target.slice))
            place = Place(scope.module, target)
            self._evaluator.methods.call(owner, 'pop', Arguments((given,)), place)
        else:
            self._evaluator.escape(owner)

    # Definitions

    def _functiondef(self, node: ast.FunctionDef | ast.AsyncFunctionDef, scope: Scope) -> None:
        function = self._evaluator.functions.define(node, scope)
        scope.set(node.name, self._evaluator.functions.decorate(function, node, scope))

    _asyncfunctiondef = _functiondef

    def _classdef(self, node: ast.ClassDef, scope: Scope) -> None:
        outer = None if scope.function is None else scope
        made = Class(scope.module, node, outer)
        scope.set(node.name, self._evaluator.functions.decorate(made, node, scope))

    def _import(self, node: ast.Import | ast.ImportFrom, scope: Scope) -> None:
        for alias in node.names:
            name = alias.asname or alias.name.partition('.')[0]
            scope.set(name, self._evaluator.imports.imported(scope.module, node, name))

    _importfrom = _import

    # Jumps

    def _expr(self, node: ast.Expr, scope: Scope) -> None:
        """A value that nothing takes may have been meant for something."""
        value = self._evaluator.evaluate(node.value, scope)
        run = self._evaluator.run
        if value == NEVER:
            scope.names = None
            return
        is_plain = not isinstance(node.value, ast.BinOp | ast.Compare)
        is_plain = is_plain or isinstance(value, Constant | Scalar)
        if isinstance(node.value, _WITHOUT_EFFECT) and is_plain:
            place = Place(scope.module, node.value)
            run.report('no-effect', place, 'this has no effect', 'return it, or remove it')
        elif isinstance(node.value, ast.Attribute) and _is_method(value):
            place = Place(scope.module, node.value)
            run.report('no-effect', place, 'this is not called', f'write {node.value.attr}()')
        elif isinstance(value, Awaitable) and isinstance(node.value, ast.Call):
            called = ast.unparse(node.value.func)
            run.report(
                'missing-await',
                Place(scope.module, node.value.func),
                f"'{called}(…)' is never awaited, so it never runs",
                'put await before it',
            )
        elif isinstance(value, Primitive) and value.kind == THREAD:
            place = Place(scope.module, node.value)
            run.report('no-effect', place, 'this thread is never started', 'write .start()')
        elif isinstance(value, Generated) and isinstance(node.value, ast.Call | ast.GeneratorExp):
            run.report(
                'no-effect',
                Place(scope.module, node.value),
                'nothing takes what this generates, so it never runs',
                "write 'yield from' before it, or go through it in a loop",
            )

    def _return(self, node: ast.Return, scope: Scope) -> None:
        value = self._evaluator.evaluate(node.value, scope) if node.value else NONE
        place = Place(scope.module, node.value or node)
        if not self._evaluator.run.dead_branches:
            scope.returned.append((value, place))
        if self._evaluator.run.doubts:
            scope.doubtful.add(id(place.node))
        scope.names = None

    def _raise(self, node: ast.Raise, scope: Scope) -> None:
        for each in (node.exc, node.cause):
            if each is not None:
                self._evaluator.evaluate(each, scope)
        scope.names = None

    def _break(self, _: ast.Break, scope: Scope) -> None:
        if scope.names is not None:
            scope.broken.append(scope.names)
        scope.names = None

    def _continue(self, _: ast.Continue, scope: Scope) -> None:
        if scope.names is not None:
            scope.continued.append(scope.names)
        scope.names = None

    def _assert(self, node: ast.Assert, scope: Scope) -> None:
        test = self._evaluator.tested(node.test, scope)
        if truth_of(test) is False:
            scope.names = None
            return
        if is_chosen(test):
            self._evaluator.run.doubt(is_chosen(test))
        self._evaluator.narrowing.narrow(node.test, scope, test, is_true=True)

    # Branches

    def _if(self, node: ast.If, scope: Scope) -> None:
        """Follow the branches; a long chain of `elif` is not nested."""
        ends: list[Names | None] = []
        doubt = decided = 0
        with ExitStack() as branches:
            while True:
                test = self._evaluator.tested(node.test, scope)
                truth = truth_of(test)
                doubt = max(doubt, is_chosen(test) if truth is None else 0)
                decided = max(decided, is_chosen(test))
                before = scope.copy_names()
                self._evaluator.narrowing.narrow(node.test, scope, test, is_true=True)
                with self._evaluator.branch(test, is_taken=True):
                    self.follow_all(node.body, scope)
                ends.append(None if truth is False else scope.names)
                scope.names = before
                self._evaluator.narrowing.narrow(node.test, scope, test, is_true=False)
                branches.enter_context(self._evaluator.branch(test, is_taken=False))
                if truth is True:
                    ends.append(None)
                    self.follow_all(node.orelse, scope)
                    break
                if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
                    node = node.orelse[0]
                    continue
                self.follow_all(node.orelse, scope)
                ends.append(scope.names)
                break
        has_jumped = any(names is None for names in ends)
        scope.names = join_names(ends)
        if has_jumped:
            # Whether the rest is reached is for the file to decide, too.
            self._evaluator.run.decided += decided > BY_STATE
            if doubt:
                self._evaluator.run.doubt(doubt)

    def _match(self, node: ast.Match, scope: Scope) -> None:
        self._evaluator.match_cases.follow(node, scope)

    # Loops

    def _for(self, node: ast.For | ast.AsyncFor, scope: Scope) -> None:
        self._evaluator.loops.follow_for(node, scope)

    _asyncfor = _for

    def _while(self, node: ast.While, scope: Scope) -> None:
        self._evaluator.loops.follow_while(node, scope)

    # Guards

    def _try(self, node: ast.Try, scope: Scope) -> None:
        self._evaluator.guards.follow_try(node, scope)

    _trystar = _try

    def _with(self, node: ast.With | ast.AsyncWith, scope: Scope) -> None:
        self._evaluator.guards.follow_with(node, scope)

    _asyncwith = _with


def _is_method(value: Value) -> bool:
    """Return whether a value does nothing until it is called."""
    owner = value.owner if isinstance(value, BoundMethod) else None
    return isinstance(value, Function) or isinstance(owner, NodeValue | PartOfNode | Primitive)
