"""What the values in behaviours come from, as far as their types are certain by that."""

from __future__ import annotations

import ast
import builtins
import re
import sys
from typing import TYPE_CHECKING, cast

from composer.node_uses.names import (
    Chain,
    Class,
    External,
    Instance,
    Names,
    Scope,
    find_stored,
)
from composer.python_source.syntax import (
    positional_names,
    stored_names,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from composer.node_uses.names import Value
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import FunctionUse, ReportedPlace

INTERFACE = re.compile(r'\.(msg|srv|action)\.')
# Functions and modules whose types are those of Python itself.
OF_PYTHON = frozenset({*dir(builtins), *sys.stdlib_module_names})
# From a value to what it comes from, at most.
_DEEPEST = 8


class Origins(Names):
    """What names stand for, also of what methods and sums give, and of items of anything."""

    def __init__(
        self, finder: ModuleFinder, functions: Iterable[FunctionUse], kept: Collection[str]
    ) -> None:
        super().__init__(finder)
        # The attributes of one type.
        self._kept = kept
        self._uses = {id(use.definition): use for use in functions}

    def find(self, place: ReportedPlace, value: ast.expr) -> Value | None:
        """Return what a value stands for at the place of a report."""
        return self.value_of(value, self._scope(place))

    def doubts(self, place: ReportedPlace, value: ast.expr) -> bool:
        """Return whether other code may give another type to what is read here."""
        return self._doubts(value, self._scope(place), 0)

    def _doubts(self, node: ast.AST | None, scope: Scope, depth: int) -> bool:
        if depth > _DEEPEST or not isinstance(node, ast.expr):
            return False
        match self.value_of(node, scope):
            case External(name=name):
                return not (INTERFACE.search(name) or name.split('.')[0] in OF_PYTHON)
            case None:
                return self._doubts_unknown(node, scope, depth)
        return isinstance(node, ast.Name) and self._doubts_unknown(node, scope, depth)

    def _doubts_unknown(self, node: ast.expr, scope: Scope, depth: int) -> bool:
        is_known = self.value_of(node, scope) is not None
        match node:
            case ast.Attribute(value=inner, attr=name):
                times = scope.module.top.stored_attributes[name]
                is_kept = name in self._kept or times <= (not isinstance(inner, ast.Name))
                return not is_kept or self._doubts(inner, scope, depth)
            case ast.Name(id=name) if scope.definition is None or name not in scope.arguments:
                stored = self.stored_in(scope.definition).get(name)
                if stored is None and scope.outer is not None:
                    return self._doubts(node, scope.outer, depth)
                if stored is None:
                    return name in scope.module.top.stored_again or not is_known
                return any(
                    (is_item and not is_known)
                    # What a function in it stores.
                    or (each is None and len(stored) > 1)
                    or self._doubts(each, scope, depth + 1)
                    for each, is_item in stored
                )
        # What is in a list of its own may be of any type.
        return isinstance(node, ast.Subscript)

    def _scope(self, place: ReportedPlace) -> Scope:
        """Return what the names mean at the place of a report."""
        scope = Scope(place.copy.module.source)
        for index, node in reversed([*enumerate(place.around)]):
            match node:
                case ast.FunctionDef() | ast.AsyncFunctionDef():
                    classes = (each for each in place.around if isinstance(each, ast.ClassDef))
                    of = next(classes, None)
                    instance = Instance(Class(scope.module, of)) if of else None
                    scope = Scope(scope.module, node, self._given_in(node, instance), scope)
                case ast.Lambda():
                    given = self._given_to(node, place.around[index:], scope)
                    scope = Scope(scope.module, node, given, scope)
                case ast.For(target=target) if not stored_names(target) & {*find_stored(node)}:
                    scope = _inside(ast.For(target, node.iter, [], []), scope)
                case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                    scope = _inside(node, scope)
        return scope

    def _given_in(self, method: FunctionNode, instance: Instance | None) -> dict[str, Value]:
        use = self._uses.get(id(method))
        own = dict.fromkeys(positional_names(method)[:1], instance)
        return {name: each for name, each in own.items() if each} | (use.given if use else {})

    def _given_to(
        self, function: ast.Lambda, around: Sequence[ast.AST], scope: Scope
    ) -> dict[str, Value]:
        """Return what a function of one parameter is called with, if that is known."""
        call = next((each for each in around if isinstance(each, ast.Call)), None)
        match call, positional_names(function):
            case (
                ast.Call(
                    func=ast.Name(id='filter' | 'map' | 'max' | 'min' | 'sorted'),
                    args=[*first, items],
                ),
                [name],
            ) if first in ([], [function]):
                item = self._item_of(self.value_of(items, scope))
                return {name: item} if item else {}
        return {}

    def _value_of(self, node: ast.expr, scope: Scope) -> Value | None:
        match node:
            case ast.Await(value=inner):
                return self.value_of(inner, scope)
            case ast.BinOp(left=left):
                # A time plus something is a time.
                origin = self.value_of(left, scope)
                is_time = isinstance(origin, Chain) and origin.path[-2:] == ('now', '()')
                return origin if is_time else None
        return super()._value_of(node, scope)

    def _result_of(self, call: ast.Call, scope: Scope) -> Value | None:
        function = self.value_of(call.func, scope)
        if isinstance(function, Chain):
            return Chain((*function.path, '()'))
        match function, call.args:
            case External(name='builtins.list' | 'builtins.sorted' | 'builtins.tuple'), [items]:
                items_of = self.value_of(items, scope)
                return items_of if isinstance(items_of, Chain) else None
            case External(name='builtins.max' | 'builtins.min'), [items]:
                return self._item_of(self.value_of(items, scope))
        return super()._result_of(call, scope)

    def _item_of(self, owner: Value | None, _index: ast.expr | None = None) -> Value | None:
        return Chain((*owner.path, '[]')) if isinstance(owner, Chain) else None


def _inside(loop: ast.AST, scope: Scope) -> Scope:
    """Return the scope of a loop, as that of a function without parameters."""
    no_arguments = ast.arguments([], [], None, [], [], None, [])
    function = ast.Lambda(no_arguments, cast('ast.expr', loop))
    return Scope(scope.module, function, {}, scope)
