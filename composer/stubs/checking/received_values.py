"""Which nodes and messages the functions of a project are given: by Composer, and by each other.

A parameter counts as known only if everything that it is given is known.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from composer.language.bindings import node_bindings
from composer.python_source.syntax import list_arguments, positional_names
from composer.stubs.project_modules import all_nodes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.checks.context import CheckContext
    from composer.language.bindings import Binding
    from composer.node_uses.reading import Wire
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.project_modules import ProjectModule

FunctionKey: TypeAlias = tuple[str, str]
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
# Longer chains of calls are not followed.
_MOST_ROUNDS = 8


@dataclass(slots=True)
class Received:
    """What a parameter is given.

    Attributes:
        nodes: The keys of nodes.
        messages: The full names of messages.
        is_open: Whether it may be given something else.
    """

    nodes: dict[str, None] = field(default_factory=dict)
    messages: dict[str, None] = field(default_factory=dict)
    is_open: bool = False

    def add(self, other: Received) -> None:
        """Take over what another parameter is given."""
        self.nodes |= other.nodes
        self.messages |= other.messages
        self.is_open |= other.is_open

    @property
    def size(self) -> int:
        """A number that grows with each addition."""
        return len(self.nodes) + len(self.messages) + self.is_open


@dataclass(slots=True)
class FunctionUse:
    """A function at the top level of a module or class, and what is known of its use.

    Attributes:
        is_method: Whether its first parameter is the object.
        received: By parameter.
        bindings: The places that it is bound to, with the types around it.
        is_called: Whether the project itself calls or passes it.
    """

    definition: FunctionNode
    received: dict[str, Received] = field(default_factory=dict)
    bindings: list[tuple[Binding, Wire]] = field(default_factory=list)
    is_called: bool = False
    is_method: bool = False

    def names(self) -> list[str]:
        """Return the names of the positional parameters."""
        names = positional_names(self.definition)
        return names[1:] if self.is_method else names

    def give(self, name: str, received: Received) -> None:
        """Note what a parameter is given."""
        self.received.setdefault(name, Received()).add(received)


def find_received_values(
    context: CheckContext, modules: Mapping[str, ProjectModule]
) -> dict[FunctionKey, FunctionUse]:
    """Return the functions of a project that are given nodes or messages, by module and name."""
    functions: dict[FunctionKey, FunctionUse] = {}
    for name, module in modules.items():
        for top in module.tree.body:
            inner = top.body if isinstance(top, ast.ClassDef) else [top]
            owner = f'{top.name}.' if isinstance(top, ast.ClassDef) else ''
            for node in inner:
                if isinstance(node, _FUNCTIONS) and not node.decorator_list:
                    use = FunctionUse(node, is_method=bool(owner))
                    functions[name, f'{owner}{node.name}'] = use
    _give_bound(context, functions)
    sizes = -1
    for _ in range(_MOST_ROUNDS):
        for module in modules.values():
            _Calls(module, functions).follow()
        grown = sum(each.size for use in functions.values() for each in use.received.values())
        if grown == sizes:
            break
        sizes = grown
    return functions


def changed_names(function: FunctionNode) -> set[str]:
    """Return the names that a function assigns, and the parameters of functions inside it."""
    names: set[str] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, (*_FUNCTIONS, ast.Lambda)) and node is not function:
            names |= {each.arg for each in list_arguments(node.args)}
    return names


def _give_bound(context: CheckContext, functions: Mapping[FunctionKey, FunctionUse]) -> None:
    for node in all_nodes(context):
        for binding in node_bindings(node):
            use = functions.get((binding.behaviour.module, binding.behaviour.function))
            if use is None:
                continue
            wire = context.behaviours.wire_of(node, binding)
            use.bindings.append((binding, wire))
            own = Received(nodes={node.key: None})
            init = f'{binding.behaviour.class_name}.__init__'
            maker = functions.get((binding.behaviour.module, init))
            if maker is not None and maker.names():
                maker.give(maker.names()[0], own)
            given = {wire.given: None} if wire.given else {}
            messages = Received(messages=given, is_open=not given)
            for name, received in zip(use.names(), (own, messages), strict=False):
                use.give(name, received)


@dataclass(slots=True)
class _Calls:
    """Follows the calls in a module."""

    module: ProjectModule
    functions: Mapping[FunctionKey, FunctionUse]

    def follow(self) -> None:
        methods: dict[str, list[FunctionUse]] = {}
        for (_, name), method in self.functions.items():
            if method.is_method:
                methods.setdefault(name.rpartition('.')[2], []).append(method)
        for statement in self.module.tree.body:
            own = self.functions.get((self.module.name, getattr(statement, 'name', '')))
            is_own = own is not None and own.definition is statement
            known = self._known(own) if own and is_own else {}
            called: set[int] = set()
            for node in ast.walk(statement):
                if isinstance(node, ast.Call) and (use := self._function(node.func)):
                    called.add(id(node.func))
                    use.is_called = True
                    self._pass(node, use, known)
            for node in ast.walk(statement):
                if isinstance(node, ast.Name | ast.Attribute) and id(node) not in called:
                    use = self._function(node)
                    if use and isinstance(node.ctx, ast.Load):
                        _open_all(use)
                    # It may be a method, of whatever object.
                    for each in methods.get(getattr(node, 'attr', ''), ()):
                        _open_all(each)

    def _known(self, use: FunctionUse) -> dict[str, Received]:
        """Return what the parameters of a function are, without those that it changes.

        A parameter that nothing is known of yet is given nothing so far.
        """
        changed = changed_names(use.definition)
        names = [name for name in use.names() if name not in changed]
        return {name: use.received.get(name, Received()) for name in names}

    def _function(self, expression: ast.expr) -> FunctionUse | None:
        imports = self.module.source.imports
        if isinstance(expression, ast.Name):
            module, _, name = imports.get(expression.id, '').rpartition('.')
            if module:
                return self.functions.get((module, name))
            return self.functions.get((self.module.name, expression.id))
        if isinstance(expression, ast.Attribute) and isinstance(expression.value, ast.Name):
            module = imports.get(expression.value.id, '')
            return self.functions.get((module, expression.attr))
        return None

    def _pass(self, call: ast.Call, use: FunctionUse, known: Mapping[str, Received]) -> None:
        names = use.names()
        if any(isinstance(each, ast.Starred) for each in call.args):
            _open_all(use)
            return
        given = dict(zip(names, call.args, strict=False))
        for keyword in call.keywords:
            if keyword.arg is None:
                _open_all(use)
                return
            given[keyword.arg] = keyword.value
        for name, value in given.items():
            passed = known.get(value.id) if isinstance(value, ast.Name) else None
            use.give(name, Received(is_open=True) if passed is None else passed)


def _open_all(use: FunctionUse) -> None:
    use.is_called = True
    for name in use.names():
        use.give(name, Received(is_open=True))
