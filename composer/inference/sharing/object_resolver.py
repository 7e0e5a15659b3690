"""Which objects of modules the expressions of a function are."""

from __future__ import annotations

import ast
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.inference.sharing.aliases import find_aliases
from composer.inference.sharing.object_classes import CACHES, makes_one
from composer.inference.sharing.shared_functions import FUNCTIONS
from composer.python_source.local_names import list_arguments, nested_names, stored_names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.inference.sharing.object_classes import ObjectClasses
    from composer.inference.sharing.shared_functions import (
        SharedFunction,
        SharedFunctions,
        SharedName,
    )


class ObjectResolver:
    """Tells which objects the expressions of one function are.

    Attributes:
        nodes: The syntax tree of the function, outer nodes first.
    """

    def __init__(
        self,
        functions: SharedFunctions,
        classes: ObjectClasses,
        function: SharedFunction,
    ) -> None:
        self._functions = functions
        self._classes = classes
        self._function = function
        self.nodes = [*ast.walk(function.definition)]
        inner = [each for each in self.nodes if each is not function.definition]
        stored = {name.id for name in stored_names(self.nodes)} | nested_names(inner)
        arguments = Counter(
            each.arg
            for node in self.nodes
            if isinstance(node, (*FUNCTIONS, ast.Lambda))
            for each in list_arguments(node.args)
        )
        # The names that the function itself stores, without those of modules and outer functions.
        self._own = (stored | arguments.keys()) - _declared(self.nodes, ast.Global)
        outer = _declared(function.definition.body, ast.Nonlocal)
        self._bound = {
            name: each
            for name, each in function.bound
            if name in outer or (name not in stored and arguments[name] <= 1)
        }
        self._aliases = find_aliases(self.nodes)
        self._resolved: dict[int, tuple[ast.AST, SharedName | None]] = {}

    def is_own(self, node: ast.AST) -> bool:
        """Return whether an expression is a name of the function itself."""
        is_name = isinstance(node, ast.Name) and node.id in self._own
        return is_name and getattr(node, 'id', '') not in self._bound

    def resolve(self, node: ast.AST) -> SharedName | None:
        """Return the object, class or function of a module that an expression is."""
        if not isinstance(node, ast.Name | ast.Attribute | ast.Call):
            return None
        # A node that was made here keeps its number as long as it is kept.
        if id(node) not in self._resolved:
            with self._functions.going_deeper() as is_allowed:
                found = self._resolve_new(node) if is_allowed else None
            self._resolved[id(node)] = node, found
        return self._resolved[id(node)][1]

    def _resolve_new(self, node: ast.Name | ast.Attribute | ast.Call) -> SharedName | None:
        match node:
            case ast.Name(id=name):
                return self._resolve_name(name)
            case ast.Attribute():
                return self._resolve_attribute(node)
        return self._resolve_call(node)

    def find_functions(self, node: ast.AST) -> list[SharedFunction]:
        """Return the functions that an expression may be; methods have their object with them."""
        name = self.resolve(node)
        found = [*self._functions.find_functions(*name)] if name is not None else []
        object_name = self.resolve(node.value) if isinstance(node, ast.Attribute) else None
        if object_name is None or self._functions.is_definition(object_name):
            return found
        return [
            replace(each, bound=((each.parameters[0], object_name),))
            if each.is_of_object and each.parameters
            else each
            for each in found
        ]

    def find_called(self, call: ast.Call) -> list[SharedFunction]:
        """Return the functions that a call may call, with the objects that they are given."""
        found = self.find_functions(call.func)
        keywords = {each.arg: each.value for each in call.keywords}
        if None in keywords or any(isinstance(each, ast.Starred) for each in call.args):
            return found
        return [replace(each, bound=self._bind(each, call, keywords)) for each in found]

    def _bind(
        self, function: SharedFunction, call: ast.Call, keywords: Mapping[str | None, ast.expr]
    ) -> tuple[tuple[str, SharedName], ...]:
        above = self.resolve(call.func.value) if isinstance(call.func, ast.Attribute) else None
        is_by_class = above is not None and self._functions.find_class(above) is not None
        has_first = function.is_of_class or (function.is_of_object and not is_by_class)
        given: dict[str | None, ast.expr] = {**keywords}
        given.update(zip(function.parameters[has_first:], call.args, strict=False))
        bound = dict(function.bound)
        defaults = function.made_defaults()
        bound |= {name: each for name, each in defaults.items() if name not in given}
        for name, value in given.items():
            found = self.resolve(value)
            if name and found is not None and not self._functions.is_definition(found):
                bound[name] = found
        return tuple(bound.items())

    def _resolve_call(self, call: ast.Call) -> SharedName | None:
        """Return the object that a call returns, if it returns the same to all."""
        name = self.resolve(call.func)
        owner = self._functions.find_class(name) if name is not None else None
        if name is not None and owner is not None:
            if makes_one(owner):
                return self._name_made(name, call, owner)
            made = self._functions.find_functions(name[0], f'{name[1]}.__new__')
            return next((self._returned(each) for each in made), None)
        match self.find_called(call):
            case [function]:
                found = self._returned(function)
                return found or self._resolve_cached(function, call)
        return None

    def _returned(self, function: SharedFunction) -> SharedName | None:
        return self._resolve_in(function, function.returned())

    def _resolve_in(
        self, function: SharedFunction, values: Sequence[ast.expr]
    ) -> SharedName | None:
        """Return the one object that all of some expressions in a function are."""
        key = (tuple(id(each) for each in values), function.bound)
        results = self._functions.results
        if key not in results:
            # Of what calls itself, nothing is known.
            results[key] = None
            reader = ObjectResolver(self._functions, self._classes, function)
            found = {reader.resolve(each) for each in values}
            results[key] = next(iter(found)) if len(found) == 1 else None
        return results[key]

    def _resolve_cached(self, function: SharedFunction, call: ast.Call) -> SharedName | None:
        """Return what a cached function returns to all who give it the same."""
        values = function.returned()
        if function.is_of_object or not function.decorators & CACHES or not values:
            return None
        return self._name_made((function.module, function.name), call, values[0])

    def _name_made(
        self, name: SharedName, call: ast.Call, value: ast.expr | ast.ClassDef
    ) -> SharedName | None:
        """Return the name of what a call makes once, for all who give it the same."""
        given = [*call.args, *call.keywords]
        values = (each.value if isinstance(each, ast.keyword) else each for each in given)
        if not all(isinstance(each, ast.Constant) for each in values):
            return None
        made = name[0], f'{name[1]}({", ".join(ast.unparse(each) for each in given)})'
        self._classes.note(made, value)
        return made

    def _resolve_attribute(self, node: ast.Attribute) -> SharedName | None:
        if isinstance(node.value, ast.Name):
            own = self._resolve_own(node.value.id, node)
            if own is not None:
                return own
        modules = self._functions.modules
        inner = self._dotted(node.value)
        if inner is not None and (home := modules.find(inner)) is not None:
            is_there = node.attr in modules.top(home).statements
            return self._functions.find_home((inner, node.attr)) if is_there else None
        owner = self.resolve(node.value)
        if owner is None:
            return None
        is_definition = self._functions.is_definition(owner)
        made = self._classes.find(owner) if not is_definition else None
        member = self._find_member(*made, node) if made is not None else None
        return member or (owner[0], f'{owner[1]}.{node.attr}')

    def _resolve_own(self, name: str, node: ast.Attribute) -> SharedName | None:
        """Return what an attribute of the first parameter of a method is: of its class."""
        function = self._function
        is_first = name in function.parameters[:1] and name not in self._bound
        if function.owner is None or not is_first:
            return None
        if function.is_of_class:
            return function.module, f'{function.owner.name}.{node.attr}'
        if not function.is_of_object:
            return None
        return self._find_member(function.module, function.owner, node)

    def _find_member(
        self, module: str, owner: ast.ClassDef | None, node: ast.Attribute
    ) -> SharedName | None:
        """Return a method of a class or a base, or an attribute that all instances share.

        What is stored in `self` is the instance's own, unless it is another object of a module.
        """
        attribute = node.attr
        while owner is not None:
            name = module, f'{owner.name}.{attribute}'
            if any(isinstance(each, FUNCTIONS) and each.name == attribute for each in owner.body):
                return name
            if stores := _list_stores(owner, attribute):
                is_kept = len(stores) == 1 and is_load(node)
                return self._find_kept(module, owner, attribute) if is_kept else None
            if owner.decorator_list:
                return None
            if _is_in_body(owner, attribute):
                return name
            module, owner = self._functions.find_base(module, owner) or (module, None)
        return None

    def _find_kept(self, module: str, owner: ast.ClassDef, attribute: str) -> SharedName | None:
        """Return the object that all instances of a class keep as an attribute."""
        for made in self._functions.find_functions(module, owner.name):
            for statement in made.definition.body:
                match statement:
                    case ast.Assign(
                        targets=[ast.Attribute(value=ast.Name(id=first), attr=stored)], value=value
                    ) if stored == attribute and first in made.parameters[:1]:
                        return self._resolve_in(made, [value])
        return None

    def _resolve_name(self, name: str) -> SharedName | None:
        if name in self._bound:
            return self._bound[name]
        if name not in self._own:
            return self._functions.find_name(self._function.module, name)
        # Names may stand for each other.
        alias = self._aliases.pop(name, None)
        if alias is None:
            return None
        found = self.resolve(alias)
        self._aliases[name] = alias
        return found

    def _dotted(self, node: ast.AST) -> str | None:
        """Return the full name of the module that an expression stands for, if it may be one."""
        if isinstance(node, ast.Name):
            source = self._function.source
            return None if node.id in self._own else self._functions.imported(source, node.id)
        if isinstance(node, ast.Attribute):
            inner = self._dotted(node.value)
            return f'{inner}.{node.attr}' if inner else None
        return None


def is_load(node: ast.AST) -> bool:
    """Return whether a node is no target that is stored or deleted."""
    return isinstance(getattr(node, 'ctx', None), ast.Load)


def _declared(nodes: Sequence[ast.AST], kind: type[ast.Global | ast.Nonlocal]) -> set[str]:
    return {name for each in nodes if isinstance(each, kind) for name in each.names}


def _is_in_body(owner: ast.ClassDef, attribute: str) -> bool:
    return any(
        isinstance(target, ast.Name) and target.id == attribute
        for statement in owner.body
        if isinstance(statement, ast.Assign)
        for target in statement.targets
    )


def _list_stores(owner: ast.ClassDef, attribute: str) -> list[ast.Attribute]:
    """Return where methods of a class store an attribute of this name in anything."""
    return [
        node
        for node in ast.walk(owner)
        if isinstance(node, ast.Attribute) and node.attr == attribute and not is_load(node)
    ]
