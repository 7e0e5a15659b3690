"""The functions, classes and objects that names at the top of modules stand for."""

from __future__ import annotations

import ast
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

from composer.inference.module_names import ProjectModules
from composer.python_source.local_names import list_arguments, stored_names
from composer.python_source.syntax import list_children
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.modules import ModuleSource
    from composer.python_source.syntax import FunctionNode

# A module, and an object in it: `STATE`, `Driver.count` of a class, `step.seen` of a function,
# `load()` that a cached function returns.
SharedName: TypeAlias = tuple[str, str]
# Names of a function that are such objects.
Bound: TypeAlias = tuple[tuple[str, SharedName], ...]
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_SCOPES = (*FUNCTIONS, ast.Lambda, ast.ClassDef)
_COMPOSER = 'composer'
_MOST_IMPORTS = 8
# Longer chains of attributes and calls are not followed.
_MOST_STEPS = 50


@record
class SharedFunction:
    """A function, and what surrounds it.

    Attributes:
        owner: The class that it is a method of, or `None`.
        bound: Its parameters, and variables of the function that made it, that are objects
            which several nodes may have.
    """

    module: str
    source: ModuleSource
    definition: FunctionNode
    owner: ast.ClassDef | None = None
    bound: Bound = ()

    @property
    def name(self) -> str:
        """Its name in the module: `step`, `Driver.step`."""
        owner = f'{self.owner.name}.' if self.owner is not None else ''
        return f'{owner}{self.definition.name}'

    @property
    def decorators(self) -> set[str]:
        """The names of its decorators, without their arguments."""
        return decorators_of(self.definition)

    @property
    def is_of_class(self) -> bool:
        """Whether its first parameter is the class."""
        is_made = self.owner is not None and self.definition.name == '__new__'
        return 'classmethod' in self.decorators or is_made

    @property
    def is_of_object(self) -> bool:
        """Whether its first parameter is an object of its class."""
        is_free = self.owner is None or 'staticmethod' in self.decorators
        return not is_free and not self.is_of_class

    @property
    def parameters(self) -> list[str]:
        """Its parameters that may be given by position."""
        arguments = self.definition.args
        return [each.arg for each in (*arguments.posonlyargs, *arguments.args)]

    def returned(self) -> list[ast.expr]:
        """Return what it returns, as expressions."""
        nodes = _list_own(self.definition)
        return [each.value for each in nodes if isinstance(each, ast.Return) and each.value]

    def find_made(self, position: int, count: int) -> FunctionNode | None:
        """Return the inner function that it returns, as one of so many values."""
        inner = {each.name: each for each in self.definition.body if isinstance(each, FUNCTIONS)}
        match self.returned():
            case [ast.Name(id=name)] if count == 1:
                return inner.get(name)
            case [ast.Tuple(elts=values)] if len(values) == count:
                value = values[position]
                return inner.get(value.id) if isinstance(value, ast.Name) else None
        return None

    def variables(self) -> set[str]:
        """Return its parameters and variables."""
        stored = {each.id for each in stored_names(_list_own(self.definition))}
        return stored | {each.arg for each in list_arguments(self.definition.args)}

    def made_defaults(self) -> dict[str, SharedName]:
        """Return the parameters whose default is an object that all calls share."""
        arguments = self.definition.args
        positional = [*arguments.posonlyargs, *arguments.args][::-1]
        pairs = [
            *zip(positional, arguments.defaults[::-1], strict=False),
            *zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True),
        ]
        made = ast.List | ast.Dict | ast.Set | ast.Call
        return {
            parameter.arg: (self.module, f'{self.name}.{parameter.arg}')
            for parameter, default in pairs
            if isinstance(default, made)
        }


def _list_own(definition: FunctionNode) -> list[ast.AST]:
    """Return the nodes of a function without those of functions and classes in it."""
    nodes: list[ast.AST] = [*definition.body]
    for node in nodes:
        if not isinstance(node, _SCOPES):
            nodes += list_children(node)
    return nodes


def decorators_of(definition: FunctionNode | ast.ClassDef) -> set[str]:
    """Return the names of decorators, without their arguments and modules."""
    called = (getattr(each, 'func', each) for each in definition.decorator_list)
    return {ast.unparse(each).rpartition('.')[2] for each in called}


class SharedFunctions:
    """Finds what names at the top of modules stand for."""

    def __init__(self, finder: ModuleFinder) -> None:
        self.modules = ProjectModules(finder)
        # What expressions in functions are, by these and what the functions are given.
        self.results: dict[tuple[tuple[int, ...], Bound], SharedName | None] = {}
        self._depth = 0

    @contextmanager
    def going_deeper(self) -> Iterator[bool]:
        """Follow another name, attribute or call; tell whether these are not too many."""
        self._depth += 1
        try:
            yield self._depth <= _MOST_STEPS
        finally:
            self._depth -= 1

    def find_functions(self, module: str, name: str) -> Iterator[SharedFunction]:
        """Yield a function, a method, or what makes an instance of a class."""
        # Nothing of Composer itself is shared by behaviours, and it is large.
        source = self.modules.find(module) if module.partition('.')[0] != _COMPOSER else None
        if source is None:
            return
        class_name, _, method = name.rpartition('.')
        if not class_name:
            class_name, method = name, '__init__'
        for each in self._statements((module, name)):
            if isinstance(each, FUNCTIONS):
                yield SharedFunction(module, source, each)
            elif isinstance(each, ast.Assign):
                yield from self._find_made(module, name, each)
        for owner in self._statements((module, class_name)):
            if isinstance(owner, ast.ClassDef):
                for each in owner.body:
                    if isinstance(each, FUNCTIONS) and each.name == method:
                        yield SharedFunction(module, source, each, owner)

    def is_definition(self, name: SharedName) -> bool:
        """Return whether a name is that of a class or a function."""
        return self.find_class(name) is not None or any(self.find_functions(*name))

    def find_class(self, name: SharedName) -> ast.ClassDef | None:
        """Return the class that a name at the top of a module stands for."""
        classes = [each for each in self._statements(name) if isinstance(each, ast.ClassDef)]
        return classes[0] if classes else None

    def find_base(self, module: str, owner: ast.ClassDef) -> tuple[str, ast.ClassDef] | None:
        """Return the one base of a class; `None` if it has others, or none of the project."""
        match owner.bases:
            case [ast.Name(id=name)] if name != owner.name:
                home = self.find_home((module, name))
                found = self.find_class(home)
                return (home[0], found) if found is not None else None
        return None

    def find_name(self, module: str, name: str) -> SharedName | None:
        """Return what a name stands for that code of a module uses, and does not store itself."""
        source = self.modules.find(module)
        if source is None:
            return None
        found = self.imported(source, name)
        if found is None:
            is_own = self._statements((module, name)) and not self._is_import((module, name))
            return self.find_home((module, name)) if is_own else None
        home, _, inner = found.rpartition('.')
        is_name = home and self.modules.find(home) is not None
        return self.find_home((home, inner)) if is_name else None

    def find_home(self, name: SharedName) -> SharedName:
        """Return a name as the module has it that makes it, not one that imports it from there."""
        for _ in range(_MOST_IMPORTS):
            source = self.modules.find(name[0])
            if source and (other := self._find_alias(name)):
                name = name[0], other
                continue
            found = self.imported(source, name[1]) if source else None
            home, _, inner = (found or '').rpartition('.')
            if not home or self.modules.find(home) is None:
                break
            name = home, inner
        return name

    def imported(self, source: ModuleSource, name: str) -> str | None:
        """Return the full name of what a module imports under a name."""
        for statement, _ in self.modules.top(source).statements.get(name, ()):
            if isinstance(statement, ast.Import | ast.ImportFrom):
                return self.modules.imported(source, statement, name) or None
        return None

    def _find_alias(self, name: SharedName) -> str | None:
        """Return the name at the top of a module that another one there is always the same as."""
        match self._statements(name):
            case [ast.Assign(targets=[ast.Name()], value=ast.Name(id=other))]:
                is_there = self._statements((name[0], other))
                return other if is_there and other != name[1] else None
        return None

    def _find_made(
        self, module: str, name: str, statement: ast.Assign
    ) -> Iterator[SharedFunction]:
        """Yield the inner function that a call at the top of a module returns, under a name.

        Variables of the outer function are objects of that call alone.
        """
        match statement:
            case ast.Assign(targets=[target], value=ast.Call(func=ast.Name(id=outer))):
                home = self.find_name(module, outer)
            case _:
                return
        source = self.modules.find(home[0]) if home else None
        if home is None or source is None:
            return
        names = [each.id for each in ast.walk(target) if isinstance(each, ast.Name)]
        for definition in self._statements(home):
            if isinstance(definition, FUNCTIONS):
                factory = SharedFunction(home[0], source, definition)
                made = factory.find_made(names.index(name), len(names))
                if made is not None:
                    kept = factory.variables() - {each.arg for each in list_arguments(made.args)}
                    bound = ((each, (module, f'{names[0]}.{each}')) for each in sorted(kept))
                    yield SharedFunction(home[0], source, made, bound=tuple(bound))

    def _is_import(self, name: SharedName) -> bool:
        return any(
            isinstance(each, ast.Import | ast.ImportFrom) for each in self._statements(name)
        )

    def _statements(self, name: SharedName) -> list[ast.AST]:
        source = self.modules.find(name[0])
        found = self.modules.top(source).statements.get(name[1], ()) if source else ()
        return [each for each, _ in found]
