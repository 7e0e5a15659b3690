"""Which names at the top of modules a behaviour reads, and which it changes.

Names at the top of a module, and attributes of its classes, are what behaviours of several nodes
share as long as these run in one process. Functions that a behaviour calls, or hands on, count as
its own. Nothing is imported.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from composer.inference.aliases import find_aliases
from composer.inference.classes.attribute_stores import CHANGING
from composer.inference.module_names import ProjectModules
from composer.python_source.local_names import list_arguments, nested_names, stored_names
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Span
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.modules import ModuleSource
    from composer.python_source.syntax import FunctionNode

# A module, and a name in it, as in `parts` and `STATE`, or `Driver.count` of a class.
SharedName: TypeAlias = tuple[str, str]
# Beside those of containers: those of queues and events.
_CHANGING = CHANGING | {'put', 'put_nowait', 'set'}
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_COMPOSER = 'composer'
# A behaviour that calls more is too large to follow.
_MOST_FUNCTIONS = 200
_MOST_IMPORTS = 8


@dataclass(slots=True)
class NameUses:
    """What a behaviour does with names at the top of modules: the first place of each."""

    read: dict[SharedName, Span] = field(default_factory=dict)
    changed: dict[SharedName, Span] = field(default_factory=dict)


@record
class _Function:
    """A function, and what surrounds it.

    Attributes:
        owner: The class that it is a method of, or `None`.
    """

    module: str
    source: ModuleSource
    definition: FunctionNode
    owner: ast.ClassDef | None = None


class SharedNames:
    """Reads what behaviours do with names at the top of modules."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._modules = ProjectModules(finder)
        self._found: dict[tuple[str, str], NameUses] = {}

    def uses_of(self, module: str, function: str) -> NameUses:
        """Return what a function, or `Class.method`, reads and changes."""
        key = (module, function)
        if key not in self._found:
            self._found[key] = self._follow(module, function)
        return self._found[key]

    def _follow(self, module: str, function: str) -> NameUses:
        uses = NameUses()
        # The instance of a class is made with the node.
        owner = function.rpartition('.')[0]
        made = self._find_functions(module, owner) if owner else ()
        pending = [*self._find_functions(module, function), *made]
        seen = {id(each.definition) for each in pending}
        while pending and len(seen) < _MOST_FUNCTIONS:
            reader = _FunctionReader(self._modules, pending.pop(), uses)
            for target in reader.read():
                for each in self._find_functions(*target):
                    if id(each.definition) not in seen:
                        seen.add(id(each.definition))
                        pending.append(each)
        return uses

    def _find_functions(self, module: str, name: str) -> Iterator[_Function]:
        """Yield a function, a method, or what makes an instance of a class."""
        # Nothing of Composer itself is shared by behaviours, and it is large.
        if module.partition('.')[0] == _COMPOSER:
            return
        source = self._modules.find(module)
        if source is None:
            return
        class_name, _, method = name.rpartition('.')
        if not class_name:
            class_name, method = name, '__init__'
        statements = [each for each, _ in self._modules.top(source).statements.get(name, ())]
        yield from (
            _Function(module, source, each) for each in statements if isinstance(each, _FUNCTIONS)
        )
        owners = self._modules.top(source).statements.get(class_name, ())
        for owner, _ in owners:
            if isinstance(owner, ast.ClassDef):
                for each in owner.body:
                    if isinstance(each, _FUNCTIONS) and each.name == method:
                        yield _Function(module, source, each, owner)


class _FunctionReader:
    """Reads one function.

    Args:
        uses: What it reads and changes is added to it.
    """

    def __init__(self, modules: ProjectModules, function: _Function, uses: NameUses) -> None:
        self._modules = modules
        self._function = function
        self._uses = uses
        self._nodes = [*ast.walk(function.definition)]
        named = {
            name for node in self._nodes if isinstance(node, ast.Global) for name in node.names
        }
        own = {name.id for name in stored_names(self._nodes)} | nested_names(
            each for each in self._nodes if each is not function.definition
        )
        for node in self._nodes:
            if isinstance(node, (*_FUNCTIONS, ast.Lambda)):
                own |= {each.arg for each in list_arguments(node.args)}
        self._own = own - named
        self._aliases = find_aliases(self._nodes, self._own)

    def read(self) -> list[SharedName]:
        """Note what the function reads and changes; return the functions that it refers to."""
        # The object of a change is not read: in `STATE['x'] = 1`, nobody learns what it holds.
        targets = {id(part) for node in self._nodes for part in self._note_change(node)}
        referred = []
        for node in self._nodes:
            if id(node) in targets or not isinstance(node, ast.Name | ast.Attribute):
                continue
            if isinstance(node.ctx, ast.Load) and (name := self._resolve(node)):
                referred.append(name)
                self._uses.read.setdefault(name, self._place(node))
        return referred

    def _note_change(self, node: ast.AST) -> Iterator[ast.AST]:
        """Note what a node changes; yield the parts of it that only lead there."""
        match node:
            case ast.Name(id=stored, ctx=ast.Store() | ast.Del()) if stored in self._own:
                return
            case (
                ast.Name(ctx=ast.Store() | ast.Del()) | ast.Attribute(ctx=ast.Store() | ast.Del())
            ):
                changed: ast.AST = node
            case ast.Subscript(value=inner, ctx=ast.Store() | ast.Del()):
                changed = inner
            case ast.Call(func=ast.Attribute(value=inner, attr=method) as function):
                # A function of this name, of a module or a class, is followed.
                if method not in _CHANGING or self._resolve(function):
                    return
                changed = inner
            case _:
                return
        name = self._resolve(changed)
        while name is None and isinstance(changed, ast.Attribute | ast.Subscript):
            changed = changed.value
            name = self._resolve(changed)
        if name is None:
            return
        self._uses.changed.setdefault(name, self._place(node))
        yield from ast.walk(changed)
        yield from (each for each in [getattr(node, 'func', None)] if each)

    def _resolve(self, node: ast.AST) -> SharedName | None:
        """Return the name at the top of a module that an expression is."""
        if isinstance(node, ast.Name):
            return self._resolve_name(node.id)
        if not isinstance(node, ast.Attribute):
            return None
        if isinstance(node.value, ast.Name):
            own = self._resolve_own(node.value.id, node.attr)
            if own is not None:
                return own
        inner = self._dotted(node.value)
        if inner is not None and (home := self._modules.find(inner)) is not None:
            is_there = node.attr in self._modules.top(home).statements
            return self._find_home((inner, node.attr)) if is_there else None
        owner = self._resolve(node.value)
        return (owner[0], f'{owner[1]}.{node.attr}') if owner and self._is_class(owner) else None

    def _resolve_own(self, name: str, attribute: str) -> SharedName | None:
        """Return what an attribute of the first parameter of a method is: of its class."""
        function = self._function
        owner, arguments = function.owner, function.definition.args
        first = next(iter((*arguments.posonlyargs, *arguments.args)), None)
        if owner is None or first is None or first.arg != name:
            return None
        decorators = {ast.unparse(each) for each in function.definition.decorator_list}
        if 'staticmethod' in decorators:
            return None
        methods = {each.name for each in owner.body if isinstance(each, _FUNCTIONS)}
        if 'classmethod' in decorators or attribute in methods:
            return function.module, f'{owner.name}.{attribute}'
        return self._find_class_attribute(attribute)

    def _find_class_attribute(self, attribute: str) -> SharedName | None:
        """Return an attribute that all instances share, of the class of this method or a base.

        What is stored in `self` is the instance's own: each node has one.
        """
        module, owner = self._function.module, self._function.owner
        while owner is not None and not owner.decorator_list:
            if _is_stored_in_instances(owner, attribute):
                return None
            if _is_in_body(owner, attribute):
                return module, f'{owner.name}.{attribute}'
            base = self._find_base(module, owner)
            module, owner = base or (module, None)
        return None

    def _find_base(self, module: str, owner: ast.ClassDef) -> tuple[str, ast.ClassDef] | None:
        """Return the one base of a class; `None` if it has others, or none of the project."""
        source = self._modules.find(module)
        match owner.bases:
            case [ast.Name(id=name)] if source is not None and name != owner.name:
                home = self._find_home((module, name))
            case _:
                return None
        found = self._modules.find(home[0])
        statements = self._modules.top(found).statements.get(home[1], ()) if found else ()
        classes = [each for each, _ in statements if isinstance(each, ast.ClassDef)]
        return (home[0], classes[0]) if len(classes) == 1 else None

    def _resolve_name(self, name: str) -> SharedName | None:
        if name in self._own:
            alias = self._aliases.get(name)
            return self._resolve(alias) if alias is not None else None
        module, source = self._function.module, self._function.source
        found = self._imported(source, name)
        if found is None:
            is_here = name in self._modules.top(source).statements
            is_own = is_here and not self._is_import(source, name)
            return self._find_home((module, name)) if is_own else None
        home, _, inner = found.rpartition('.')
        is_name = home and self._modules.find(home) is not None
        return self._find_home((home, inner)) if is_name else None

    def _find_home(self, name: SharedName) -> SharedName:
        """Return a name as the module has it that makes it, not one that imports it from there."""
        for _ in range(_MOST_IMPORTS):
            source = self._modules.find(name[0])
            if source and (other := self._find_alias(source, name[1])):
                name = name[0], other
                continue
            found = self._imported(source, name[1]) if source else None
            home, _, inner = (found or '').rpartition('.')
            if not home or self._modules.find(home) is None:
                break
            name = home, inner
        return name

    def _find_alias(self, source: ModuleSource, name: str) -> str | None:
        """Return the name at the top of a module that another one there is always the same as."""
        top = self._modules.top(source).statements
        match [each for each, _ in top.get(name, ())]:
            case [ast.Assign(targets=[ast.Name()], value=ast.Name(id=other))] if other in top:
                return other if other != name else None
        return None

    def _dotted(self, node: ast.AST) -> str | None:
        """Return the full name of the module that an expression stands for, if it may be one."""
        if isinstance(node, ast.Name):
            return None if node.id in self._own else self._imported(self._function.source, node.id)
        if isinstance(node, ast.Attribute):
            inner = self._dotted(node.value)
            return f'{inner}.{node.attr}' if inner else None
        return None

    def _imported(self, source: ModuleSource, name: str) -> str | None:
        """Return the full name of what a module imports under a name."""
        for statement, _ in self._modules.top(source).statements.get(name, ()):
            if isinstance(statement, ast.Import | ast.ImportFrom):
                return self._modules.imported(source, statement, name) or None
        return None

    def _is_import(self, source: ModuleSource, name: str) -> bool:
        statements = self._modules.top(source).statements.get(name, ())
        return any(isinstance(each, ast.Import | ast.ImportFrom) for each, _ in statements)

    def _is_class(self, name: SharedName) -> bool:
        source = self._modules.find(name[0])
        statements = self._modules.top(source).statements.get(name[1], ()) if source else ()
        return any(isinstance(each, ast.ClassDef) for each, _ in statements)

    def _place(self, node: ast.AST) -> Span:
        return self._function.source.place_of(getattr(node, 'lineno', 1))


def _is_in_body(owner: ast.ClassDef, attribute: str) -> bool:
    return any(
        isinstance(target, ast.Name) and target.id == attribute
        for statement in owner.body
        if isinstance(statement, ast.Assign)
        for target in statement.targets
    )


def _is_stored_in_instances(owner: ast.ClassDef, attribute: str) -> bool:
    """Return whether a method of a class stores an attribute of this name in anything."""
    return any(
        isinstance(node, ast.Attribute)
        and node.attr == attribute
        and isinstance(node.ctx, ast.Store | ast.Del)
        for node in ast.walk(owner)
    )
