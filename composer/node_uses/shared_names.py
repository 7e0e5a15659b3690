"""Which objects of modules a behaviour reads, and which it changes.

Names at the top of a module, and attributes of its classes, are what behaviours of several nodes
share as long as these run in one process. Functions that a behaviour calls, or hands on, count as
its own.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, TypeAlias

from composer.node_uses.names import (
    Class,
    External,
    Function,
    Instance,
    Made,
    Module,
    Names,
    Scope,
)
from composer.node_uses.waiting import FILLING
from composer.python_source.syntax import list_nodes, words_in

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.modules import ModuleSource

# A module, and a name in it, as in `Robot.pose`.
SharedName: TypeAlias = tuple[str, str]
_ASSIGNING = (ast.Assign, ast.AnnAssign)
# A behaviour that calls more is too large to follow.
_MOST_FUNCTIONS = 200
# Longer ways from a name to its object are not followed.
_MOST_STEPS = 20
# Methods of containers that change them.
_CHANGING = frozenset(
    {
        *('add', 'append', 'appendleft', 'clear', 'discard', 'extend', 'insert', 'pop', 'popitem'),
        *('popleft', 'remove', 'reverse', 'setdefault', 'sort', 'update'),
    }
)


@dataclass(slots=True)
class NameUses:
    """What behaviours do with objects: where first, for each."""

    read: dict[SharedName, Span] = field(default_factory=dict)
    changed: dict[SharedName, Span] = field(default_factory=dict)


class SharedNames:
    """Reads what behaviours do with objects of modules."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._names = Names(finder)
        self.uses_of = cache(self._follow)

    def _follow(self, name: str, function: str) -> NameUses:
        """Return what a function of a module, or `Class.method`, reads and changes."""
        uses = NameUses()
        module = self._names.find_module(name)
        owner, _, method = function.rpartition('.')
        first = self._names.top_value(module, owner or function) if module else None
        several = [first]
        if isinstance(first, Class):
            # The object is made with the node.
            several = [self._names.attribute(first, each) for each in (method, '__init__')]
        pending = [each for each in several if isinstance(each, Function)]
        seen: set[int] = set()
        while pending and len(seen) < _MOST_FUNCTIONS:
            each = pending.pop()
            if id(each.definition) not in seen:
                seen.add(id(each.definition))
                pending += self._read(each, uses)
        return uses

    def _read(self, function: Function, uses: NameUses) -> list[Function]:
        """Note what a function does; return those that it mentions."""
        scope = Scope(function.module, function.definition, {})
        nodes = list_nodes([function.definition])
        changed = {id(each) for node in nodes for each in self._changed_by(node, scope)}
        stored = {name for node in nodes if isinstance(node, ast.Global) for name in node.names}
        found: list[Function] = []
        for node in nodes:
            if not isinstance(node, ast.Name | ast.Attribute):
                continue
            if isinstance(value := self._names.value_of(node, scope), Function):
                found.append(value)
            shared = self._shared(node, scope)
            if shared is None:
                continue
            is_stored = isinstance(node.ctx, ast.Store | ast.Del)
            if isinstance(node, ast.Name) and is_stored and node.id not in stored:
                continue
            is_change = is_stored or id(node) in changed
            users = uses.changed if is_change else uses.read
            users.setdefault(shared, function.module.span_of(node))
        return found

    def _shared(self, node: ast.Name | ast.Attribute, scope: Scope) -> SharedName | None:
        """Return the shared object that an expression is."""
        if isinstance(node, ast.Name):
            if not self._names.is_local(node.id, scope):
                return self._of_module(scope.module, node.id)
            value = self._names.alias_of(node.id, scope)
            if isinstance(value, ast.Name) and self._names.is_local(value.id, scope):
                return None
            if isinstance(node.ctx, ast.Load) and isinstance(value, ast.Name | ast.Attribute):
                return self._shared(value, scope)
            return None
        owner = self._names.value_of(node.value, scope)
        match owner:
            case Class(module=module, definition=definition):
                assigned = [each for each in definition.body if isinstance(each, _ASSIGNING)]
                names = {name for each in assigned for name in words_in(each)}
                if node.attr in names:
                    return self._names.name_of(module), f'{definition.name}.{node.attr}'
            case Instance() if isinstance(node.value, ast.Name):
                shared = self._shared(node.value, scope)
                return (shared[0], f'{shared[1]}.{node.attr}') if shared else None
            case Module(source=home):
                return self._of_module(home, node.attr)
        return None

    def _of_module(self, module: ModuleSource, name: str) -> SharedName | None:
        for _ in range(_MOST_STEPS):
            match module.top.statements.get(name):
                case [(ast.Import() | ast.ImportFrom() as statement, _), *_]:
                    full_name = self._names.full_name(module, statement, name)
                    owner, _, name = full_name.rpartition('.')
                    home = self._names.find_module(owner)
                    if home is None:
                        return None
                    module = home
                case [(ast.Assign(value=ast.Name(id=other)), _)]:
                    # The same object by another name.
                    name = other
                case [(ast.Assign() | ast.AnnAssign(), _), *_]:
                    return self._names.name_of(module), name
                case _:
                    return None
        return None

    def _changed_by(self, node: ast.AST, scope: Scope) -> list[ast.expr]:
        """Return what a statement or call changes the inside of: of `D['a'].append(1)`, D, too."""
        changed: list[ast.expr] = []
        match node:
            case ast.Call(func=ast.Attribute(value=owner, attr=method)):
                value = self._names.value_of(owner, scope)
                kind = value.kind if isinstance(value, Made) else ''
                if method in FILLING.get(kind, _CHANGING) and not isinstance(value, External):
                    changed = [owner]
            case ast.Subscript(value=owner, ctx=ast.Store() | ast.Del()):
                changed = [owner]
            case ast.AugAssign(target=target):
                return [target]
        while changed and isinstance(changed[-1], ast.Subscript):
            changed.append(changed[-1].value)
        return changed
