"""What the names at the top of a module stand for."""

from __future__ import annotations

import ast
import builtins
import sys
from functools import cached_property
from typing import TYPE_CHECKING

from composer.inference.classes.attribute_stores import ANY, find_stores
from composer.inference.values import UNKNOWN, External, Value
from composer.python_source.changed_names import ALL, NOTHING, ChangedNames
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import BLOCKS, list_children, list_nodes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.inference.classes.attribute_stores import AttributeStore
    from composer.python_source.function_kinds import FunctionKind
    from composer.python_source.module_finder import ModuleFinder

_INSTALLED = {'site-packages', 'dist-packages'}
_BINDING = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


class TopNames:
    """The names that the statements of a module store, without those that may change later."""

    def __init__(self, body: Iterable[ast.stmt]) -> None:
        self.statements: dict[str, list[tuple[ast.AST, bool]]] = {}
        self.is_open = False
        self.stars: list[ast.ImportFrom] = []
        self._body = list(body)
        pending: list[tuple[ast.AST, bool]] = [(each, False) for each in reversed(self._body)]
        while pending:
            statement, is_conditional = pending.pop()
            for name in self._stored(statement):
                self.statements.setdefault(name, []).append((statement, is_conditional))
            if not isinstance(statement, _BINDING):
                blocks = (getattr(statement, name, ()) for name in BLOCKS)
                pending += [(each, True) for block in blocks for each in block]

    @cached_property
    def imports(self) -> list[ast.Import | ast.ImportFrom]:
        """The imports of the module, those in functions included."""
        return [each for each in self._nodes if isinstance(each, ast.Import | ast.ImportFrom)]

    def imports_of(self, name: str) -> Iterator[tuple[str, ast.ImportFrom]]:
        """Yield the imports of a name from some module, and what it is called then."""
        for statement in self.imports:
            for alias in statement.names:
                if isinstance(statement, ast.ImportFrom) and alias.name == name:
                    yield alias.asname or name, statement

    def _stored(self, statement: ast.AST) -> Iterator[str]:
        if isinstance(statement, _BINDING):
            yield statement.name
            self.is_open |= statement.name == '__getattr__'
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            for alias in statement.names:
                if alias.name == '*' and isinstance(statement, ast.ImportFrom):
                    self.is_open = True
                    self.stars.append(statement)
                    continue
                yield alias.asname or alias.name.partition('.')[0]
        elif isinstance(statement, ast.ExceptHandler):
            yield from filter(None, [statement.name])
        elif not isinstance(statement, ast.match_case):
            for node in _own(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    yield node.id

    @cached_property
    def patched(self) -> frozenset[str]:
        """Names of attributes that the module itself stores in something, and `setattr` does."""
        found: set[str] = set()
        for statement in self._body:
            if isinstance(statement, _BINDING):
                continue
            for node in list_nodes([statement]):
                match node:
                    case ast.Attribute(attr=name, ctx=ast.Store()):
                        found.add(name)
                    case ast.Call(func=ast.Name('setattr'), args=[_, ast.Constant(str(name)), _]):
                        found.add(name)
        return frozenset(found)

    @cached_property
    def changes(self) -> ChangedNames:
        """What code changes of what the names hold."""
        return ChangedNames(self._body)

    @cached_property
    def changed(self) -> frozenset[str]:
        """Names that functions store, and those whose values are changed somewhere."""
        changes = self.changes.all_changes()
        return self.stored_again | {name for name, change in changes.items() if change == ALL}

    @cached_property
    def is_dynamic(self) -> bool:
        """Whether code may store any name: `globals()['x'] = 1`, `exec`, `sys.modules`."""
        return any(map(self._may_store_any, self._nodes))

    def _may_store_any(self, node: ast.AST) -> bool:
        match node:
            case ast.Call(func=ast.Name('exec' | 'eval')):
                return True
            case ast.Call(func=ast.Name('globals' | 'locals' | 'vars')):
                return self.changes.change_at(node) != NOTHING
            case ast.Attribute(attr='modules') | ast.alias(name='modules'):
                return True
        return False

    @cached_property
    def fills_others(self) -> bool:
        """Whether code may store any name in a module that is imported."""
        imported = {alias.asname or alias.name for each in self.imports for alias in each.names}
        for node in self._nodes:
            match node:
                case (
                    ast.Call(func=ast.Name('setattr'), args=[ast.Name(id=name), key, _])
                    | ast.Call(func=ast.Name('vars'), args=[ast.Name(id=name) as key])
                    | ast.Attribute(value=ast.Name(id=name) as key, attr='__dict__')
                ):
                    if name in imported and not isinstance(key, ast.Constant):
                        return True
        return False

    @cached_property
    def stored_again(self) -> frozenset[str]:
        """Names that functions store, and those of which items are stored."""
        found: set[str] = set()
        for node in self._nodes:
            match node:
                case ast.Global(names=names):
                    found |= set(names)
                case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store() | ast.Del()):
                    found.add(name)
                case ast.AugAssign(target=ast.Name(id=name)):
                    found.add(name)
        return frozenset(found)

    @cached_property
    def _nodes(self) -> list[ast.AST]:
        return list_nodes(self._body)


def _own(statement: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a statement without those of the statements in it."""
    pending: list[ast.AST] = [statement]
    while pending:
        node = pending.pop()
        yield node
        pending += [
            each
            for each in list_children(node)
            if not isinstance(each, ast.stmt | ast.ExceptHandler | ast.match_case)
        ]


class ProjectModules:
    """The modules of the project, and the names at their tops."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._finder = finder
        self._names: dict[int, str] = {}
        self._read: dict[int, ModuleSource] = {}
        self._tops: dict[int, TopNames] = {}
        self._values: dict[tuple[int, str], Value] = {}
        self._under_way: set[tuple[int, str]] = set()
        # The functions that were read, by their syntax trees.
        self.followed: set[int] = set()
        # What calls of functions return, by their syntax trees.
        self.kinds: dict[int, FunctionKind] = {}
        self._stores: dict[int, dict[str, list[AttributeStore]]] = {}

    def stores_of(self, name: str) -> list[AttributeStore]:
        """Return the places in all modules that were read which store an attribute."""
        found: list[AttributeStore] = []
        for key, module in tuple(self._read.items()):
            if key not in self._stores:
                self._stores[key] = find_stores(module.body, self.top(module).changes)
            found += [*self._stores[key].get(name, ()), *self._stores[key].get(ANY, ())]
        return found

    def change_of(self, module: ModuleSource, name: str) -> int:
        """Return how deep any module changes what a name at the top of one holds."""
        found = [self.top(module).changes.change_of(name)]
        found += [ALL] * self.is_stored_anyhow(module, name)
        full_name = f'{self._names.get(id(module))}.{name}'
        for other in tuple(self._read.values()):
            for alias, statement in self.top(other).imports_of(name):
                if self.imported(other, statement, alias) == full_name:
                    found.append(self.top(other).changes.change_of(alias))
        return min(found)

    def is_stored_anyhow(self, module: ModuleSource, name: str) -> bool:
        """Return whether code may store a name of a module other than by its statements."""
        stores = self.stores_of(name)
        return self.top(module).is_dynamic or any(each.owner is None for each in stores)

    def is_patched(self, name: str) -> bool:
        """Return whether a module that was read stores an attribute of this name at its top."""
        return any(name in self.top(module).patched for module in tuple(self._read.values()))

    def find(self, name: str) -> ModuleSource | None:
        """Return a module of the project, if it is one and can be read."""
        module = self._finder.find(name)
        if not isinstance(module, ModuleSource) or not is_of_project(module, name, self._finder):
            return None
        self._names.setdefault(id(module), name)
        if id(module) not in self._read:
            self._read[id(module)] = module
            for statement in self.top(module).imports:
                # What they change of it counts, too.
                for alias in statement.names:
                    stored = alias.asname or alias.name.partition('.')[0]
                    self.split(self.imported(module, statement, stored))
        return module

    def star_home(self, module: ModuleSource, name: str) -> ModuleSource | None:
        """Return the module whose name a star import brings; `None` if none is known to."""
        top = self.top(module)
        if name in top.statements or name.startswith('_'):
            return None
        for statement in reversed(top.stars):
            home = self.find(self.imported(module, statement, '*').removesuffix('.*'))
            if home is None or home is module:
                return None
            if name in self.top(home).statements:
                return home
            if self.top(home).is_open:
                return self.star_home(home, name)
        return None

    def top(self, module: ModuleSource) -> TopNames:
        """Return the names at the top of a module."""
        if id(module) not in self._tops:
            self._tops[id(module)] = TopNames(module.body)
        return self._tops[id(module)]

    def has_name(self, module: ModuleSource, name: str) -> bool:
        """Return whether a name may exist in a module."""
        top = self.top(module)
        known = name in top.statements or hasattr(builtins, name) or name in top.changed
        if known or top.is_open or top.is_dynamic or name.startswith('__'):
            return True
        others = [self.top(each) for each in tuple(self._read.values())]
        return any(name in other.patched or other.fills_others for other in others)

    def value(
        self, module: ModuleSource, name: str, evaluate: Callable[[ast.AST, bool], Value]
    ) -> Value:
        """Return what a name at the top of a module stands for.

        Args:
            evaluate: Returns what a statement stores under the name.
        """
        key = (id(module), name)
        if key in self._values:
            return self._values[key]
        if key in self._under_way:
            return UNKNOWN
        top = self.top(module)
        statements = top.statements.get(name, [])
        if not statements:
            return External(f'builtins.{name}') if _is_builtin(top, name) else UNKNOWN
        statement, is_conditional = statements[0]
        is_import = isinstance(statement, ast.Import | ast.ImportFrom)
        # Of `try: import x`, and imports for type checkers, the first one counts.
        is_known = len(statements) == 1 and (not is_conditional or is_import)
        if not is_known or name in top.stored_again:
            return UNKNOWN
        self._under_way.add(key)
        try:
            value = evaluate(statement, is_conditional)
            self._values[key] = value
        finally:
            self._under_way.discard(key)
        return self._values[key]

    def imported(self, module: ModuleSource, statement: ast.AST, name: str) -> str:
        """Return the full name of what an import stores under a name; empty if unknown."""
        if isinstance(statement, ast.Import):
            full = (alias.name for alias in statement.names if alias.asname == name)
            return next(full, name)
        if not isinstance(statement, ast.ImportFrom):
            return ''
        home = statement.module or ''
        if statement.level:
            base = self._names.get(id(module), '').split('.')
            is_package = module.path is not None and module.path.name == '__init__.py'
            kept = base[: len(base) - statement.level + is_package]
            home = '.'.join([*kept, *filter(None, [home])])
        for alias in statement.names:
            if home and (alias.asname or alias.name) == name:
                return f'{home}.{alias.name}'
        return ''

    def split(self, dotted: str) -> tuple[ModuleSource | None, str]:
        """Return the module of the project with this full name, and the name in it, if any.

        The module is `None` for what is not of the project.
        """
        top_level, _, _ = dotted.partition('.')
        if top_level in sys.stdlib_module_names or top_level in ('rclpy', 'composer'):
            return None, ''
        if (module := self.find(dotted)) is not None:
            return module, ''
        home, _, name = dotted.rpartition('.')
        return (self.find(home), name) if home else (None, '')


def is_of_project(module: ModuleSource, name: str, finder: ModuleFinder) -> bool:
    """Return whether a module is neither installed, but with the system, nor of Python itself."""
    if module.path is None or not module.body:
        return False
    if finder.is_of_ros_package(name):
        return True
    parts = set(module.path.parts)
    return not (parts & _INSTALLED) and not module.path.is_relative_to(sys.base_prefix)


def _is_builtin(top: TopNames, name: str) -> bool:
    return not top.is_open and hasattr(builtins, name)
