"""The classes of objects that behaviours share, and what their attributes are."""

from __future__ import annotations

import ast
import sys
from typing import TYPE_CHECKING, TypeAlias

from composer.inference.sharing.shared_functions import FUNCTIONS, decorators_of
from composer.python_source.syntax import list_nodes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.inference.sharing.shared_functions import SharedFunctions, SharedName

# A class, and the module that it is in.
FoundClass: TypeAlias = tuple[str, ast.ClassDef]
CACHES = frozenset({'cache', 'lru_cache'})
_SINGLETON = 'singleton'
# Methods that change queues and events; those of other packages may send it somewhere.
QUEUING = frozenset({'put', 'put_nowait', 'set'})
# What is in memory or a file that processes share.
_SHARED_BETWEEN_PROCESSES = frozenset(
    {'ShareableList', 'SharedMemory', 'frombuffer', 'memmap', 'mmap', 'shelve'}
)


class ObjectClasses:
    """Finds of which class of the project an object is."""

    def __init__(self, functions: SharedFunctions) -> None:
        self._functions = functions
        self._made: dict[SharedName, ast.expr | ast.ClassDef] = {}
        self._found: dict[SharedName, FoundClass | None] = {}

    def note(self, name: SharedName, value: ast.expr | ast.ClassDef) -> None:
        """Note what makes an object: a call of its class, or the class."""
        self._made.setdefault(name, value)

    def find(self, name: SharedName) -> FoundClass | None:
        """Return the class of an object, if all that is stored under its name has the same."""
        if name not in self._found:
            # Of what refers to itself, nothing is known.
            self._found[name] = None
            found = {self._called(*each) for each in self._list_values(name)}
            self._found[name] = next(iter(found)) if len(found) == 1 else None
        return self._found[name]

    def is_elsewhere(self, name: SharedName, method: str) -> bool:
        """Return whether what a method changes, or a store, is seen by other processes, too."""
        parts = name[1].split('.')
        for count in range(1, len(parts) + 1):
            whole = name[0], '.'.join(parts[:count])
            for module, _, value in self._list_values(whole):
                words = {
                    getattr(each, 'id', getattr(each, 'attr', '')) for each in ast.walk(value)
                }
                options = {each.arg for each in ast.walk(value) if isinstance(each, ast.keyword)}
                if words & _SHARED_BETWEEN_PROCESSES or 'buffer' in options:
                    return True
                if method in QUEUING and self._is_of_other_package(module, value):
                    return True
        return False

    def _is_of_other_package(self, module: str, value: ast.AST) -> bool:
        root = getattr(value, 'func', value)
        while isinstance(root, ast.Attribute):
            root = root.value
        source = self._functions.modules.find(module)
        if source is None or not isinstance(root, ast.Name):
            return False
        package = (self._functions.imported(source, root.id) or '').partition('.')[0]
        known = package in sys.stdlib_module_names or self._functions.modules.find(package)
        return bool(package) and not known

    def _list_values(
        self, name: SharedName
    ) -> Iterator[tuple[str, ast.ClassDef | None, ast.expr | ast.ClassDef]]:
        """Yield what is stored under a name, with its module and class; `None` is passed over."""
        if name in self._made:
            yield name[0], None, self._made[name]
            return
        parent, _, attribute = name[1].rpartition('.')
        owner = self._functions.find_class((name[0], parent)) if parent else None
        above = self.find((name[0], parent)) if parent and owner is None else None
        module, owner = above or (name[0], owner)
        for value in _list_attribute(owner, attribute) if owner else self._list_stored(name):
            if not (isinstance(value, ast.Constant) and value.value is None):
                yield module, owner, value

    def _list_stored(self, name: SharedName) -> Iterator[ast.expr]:
        """Yield what a module stores under a name, at its top and in functions."""
        source = self._functions.modules.find(name[0])
        if source is None:
            return
        top = self._functions.modules.top(source)
        at_top = top.statements.get(name[1], ())
        nodes = list_nodes(source.body) if name[1] in top.stored_again else []
        in_functions = [
            inner
            for each in nodes
            if isinstance(each, FUNCTIONS)
            if name[1] in _list_globals(each)
            for inner in list_nodes(each.body)
        ]
        for each in [*(statement for statement, _ in at_top), *in_functions]:
            match each:
                case (
                    ast.Assign(targets=[ast.Name(id=stored)], value=value)
                    | ast.AnnAssign(target=ast.Name(id=stored), value=ast.expr() as value)
                ) if stored == name[1]:
                    yield value

    def _called(
        self, module: str, owner: ast.ClassDef | None, value: ast.expr | ast.ClassDef
    ) -> FoundClass | None:
        """Return the class that a value is, or whose call it is."""
        match value:
            case ast.ClassDef():
                return module, value
            case ast.Call(func=ast.Name('cls')) if owner is not None:
                return module, owner
            case ast.Call(func=ast.Attribute(attr='__new__')) if owner is not None:
                return module, owner
            case ast.Call(func=ast.Name(id=name)):
                home = self._functions.find_name(module, name)
            case ast.Call(func=ast.Attribute(value=ast.Name(id=imported), attr=name)):
                source = self._functions.modules.find(module)
                full = self._functions.imported(source, imported) if source else None
                home = self._functions.find_home((full, name)) if full else None
            case _:
                return None
        found = self._functions.find_class(home) if home is not None else None
        return (home[0], found) if home is not None and found is not None else None


def makes_one(owner: ast.ClassDef) -> bool:
    """Return whether all calls of a class return the same object, or objects of the same state."""
    kinds = [*owner.bases, *(each.value for each in owner.keywords if each.arg == 'metaclass')]
    names = {ast.unparse(each) for each in kinds} | decorators_of(owner)
    shared = {
        each.value.attr
        for each in ast.walk(owner)
        if isinstance(each, ast.Assign)
        if isinstance(each.value, ast.Attribute)
        if ast.unparse(each.targets[0]) == 'self.__dict__'
    }
    in_body = {
        target.id
        for each in owner.body
        if isinstance(each, ast.Assign)
        for target in each.targets
        if isinstance(target, ast.Name)
    }
    is_named = any(each.lower().endswith((_SINGLETON, f'{_SINGLETON}meta')) for each in names)
    return bool(shared & in_body) or is_named or bool(names & CACHES)


def _list_globals(function: ast.AST) -> set[str]:
    nodes = ast.walk(function)
    return {name for each in nodes if isinstance(each, ast.Global) for name in each.names}


def _list_attribute(owner: ast.ClassDef, attribute: str) -> Iterator[ast.expr]:
    """Yield what a class stores under an attribute: of itself, or of its objects."""
    for each in ast.walk(owner):
        match each:
            case ast.Assign(targets=[ast.Attribute(attr=stored)], value=value):
                is_it = stored == attribute
            case ast.AnnAssign(target=ast.Attribute(attr=stored), value=ast.expr() as value):
                is_it = stored == attribute
            case ast.Assign(targets=[ast.Name(id=stored)], value=value):
                is_it = stored == attribute and each in owner.body
            case _:
                continue
        if is_it:
            yield value
