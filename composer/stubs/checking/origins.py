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
    Function,
    Instance,
    Names,
    Scope,
    find_stored,
)
from composer.python_source.syntax import (
    list_arguments,
    list_children,
    own_nodes,
    positional_names,
    stored_names,
    words_in,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from composer.node_uses.names import Value
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import FunctionUse
    from composer.stubs.checking.left_alone import ReportedPlace

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
        match node:
            case ast.Attribute(value=inner, attr=name) if not self.value_of(node, scope):
                times = scope.module.top.stored_attributes[name]
                is_known = name in self._kept or times <= 1
                return not is_known or self._doubts(inner, scope, depth)
            case ast.Name(id=name) if scope.definition is None or name not in scope.arguments:
                stored = self.stored_in(scope.definition).get(name)
                if stored is None and scope.outer is not None:
                    return self._doubts(node, scope.outer, depth)
                if stored is None:
                    return name in scope.module.top.stored_again
                is_known = self.value_of(node, scope) is not None
                return depth < _DEEPEST and any(
                    (is_item and not is_known)
                    # What a function in it stores.
                    or (each is None and len(stored) > 1)
                    or self._doubts(each, scope, depth + 1)
                    for each, is_item in stored
                )
            case ast.Subscript() if not self.value_of(node, scope):
                # What is in a list of its own may be of any type.
                return True
        return False

    def knows(self, place: ReportedPlace, value: ast.expr, *, with_state: bool) -> bool:
        """Return whether a value is of known types, however the code came to the place.

        Args:
            with_state: Whether those of the state count, although what it holds may change.
        """
        return self._knows(value, self._scope(place), with_state, 0)

    def _knows(self, node: ast.expr, scope: Scope, with_state: bool, depth: int) -> bool:  # noqa: C901, FBT001, PLR0911
        def knows(each: ast.expr, within: Scope = scope) -> bool:
            return depth < _DEEPEST and self._knows(each, within, with_state, depth + 1)

        match self.value_of(node, scope):
            case Chain(path=(_, 'state' | 'own_state', *_)):
                # What was in the state once may be something else now.
                return with_state and not isinstance(node, ast.Name)
            case External(name=name):
                return bool(INTERFACE.search(name)) or name.split('.')[0] in OF_PYTHON
            case None:
                pass
            case _:
                return True
        match node:
            case ast.Name(id=name):
                return self._knows_name(name, scope, depth)
            case ast.Call():
                return self._knows_call(node, scope, knows)
            case ast.Attribute(value=ast.Name(), attr=name):
                return name in self._kept
            case ast.Attribute(value=inner):
                # What messages that are kept have.
                return knows(inner)
            case ast.NamedExpr() | ast.Subscript() | ast.Yield() | ast.YieldFrom():
                return False
            case ast.ListComp() | ast.SetComp() | ast.GeneratorExp():
                return knows(node.elt, _inside(node, scope))
            case ast.IfExp(body=body, orelse=other):
                return knows(body) and knows(other)
        parts = [each for each in list_children(node) if isinstance(each, ast.expr)]
        return not isinstance(node, ast.DictComp) and all(map(knows, parts))

    def _knows_call(
        self, call: ast.Call, scope: Scope, knows: Callable[[ast.expr, Scope], bool]
    ) -> bool:
        called, func = self.value_of(call.func, scope), call.func
        if not isinstance(called, Function):
            # The method of a value returns what its type says.
            is_method = called is None and isinstance(func, ast.Attribute)
            of = func.value if is_method and isinstance(func, ast.Attribute) else func
            return all(knows(each, scope) for each in (of, *call.args))
        given = {name: each for name, each in self.bind(called, call, scope).items() if each}
        within = Scope(called.module, called.definition, given, called.scope)
        nodes = own_nodes(called.definition)
        returned = [each.value for each in nodes if isinstance(each, ast.Return)]
        return all(each is None or knows(each, within) for each in returned)

    def _knows_name(self, name: str, scope: Scope, depth: int) -> bool:
        def knows(each: ast.expr, within: Scope) -> bool:
            return depth < _DEEPEST and self._knows(each, within, False, depth + 1)

        within: Scope | None = scope
        while within is not None and within.definition is not None:
            if stored := self.stored_in(within.definition).get(name):
                return all(
                    isinstance(each, ast.expr) and not is_item and knows(each, within)
                    for each, is_item in stored
                )
            if name in within.arguments:
                arguments = list_arguments(within.definition.args)
                written = [each.annotation for each in arguments if each.arg == name]
                return len(words_in(*written) - {'None', 'Optional'}) == 1
            within = within.outer
        return False

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
