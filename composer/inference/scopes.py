"""Scopes: what the names of a function stand for at one point of it."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.inference.values import UNKNOWN, Value, join
from composer.python_source.local_names import list_arguments, nested_names, stored_names
from composer.python_source.syntax import list_children
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.inference.values import Function, Place
    from composer.python_source.modules import ModuleSource

Names = dict[str, Value]
_SCOPES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)


@dataclass(slots=True, eq=False)
class Scope:
    """A call of a function, or the top of a module.

    Attributes:
        function: What is called; `None` for the top of a module.
        local: All names of its own, stored anywhere in it.
        unsure: Those that inner functions may store, too.
        names: What its names stand for where the reading is; `None` where it never comes to.
        broken: What they stood for at each `break` of the innermost loop; `continued` is of
            each `continue`.
        looped: Of each loop around that is followed round by round, the names that it stores, and
            what its targets stand for in any round.
        returned: What it returns, and where.
        yielded: What it yields, and where.
        inner: The functions defined in it.
        waits: Whether who calls the behaviour waits for it.
        doubtful: The expressions that it returns where only the file decides, by their nodes.
        stored: What its names stood for anywhere.
        is_body: Whether it is the body of a class.
        version: How often a name came to stand for something else.
    """

    module: ModuleSource
    function: Function | None = None
    outer: Scope | None = None
    local: frozenset[str] = frozenset()
    unsure: frozenset[str] = frozenset()
    names: Names | None = field(default_factory=dict)
    broken: list[Names] = field(default_factory=list)
    continued: list[Names] = field(default_factory=list)
    looped: list[tuple[frozenset[str], Names]] = field(default_factory=list)
    returned: list[tuple[Value, Place]] = field(default_factory=list)
    yielded: list[tuple[Value, Place]] = field(default_factory=list)
    inner: list[Function] = field(default_factory=list)
    waits: bool = True
    doubtful: set[int] = field(default_factory=set)
    stored: Names = field(default_factory=dict)
    is_body: bool = False
    version: int = 0

    def set(self, name: str, value: Value) -> None:
        """Store what a name stands for from now on."""
        if self.names is not None:
            value = UNKNOWN if name in self.unsure else value
            self.names[name] = value
            before = self.stored.get(name)
            self.version += before != value
            self.stored[name] = value if before is None else join([before, value])

    def latest(self, name: str) -> Value | None:
        """Return what was stored in a name last, for a function that is called later."""
        return self.stored.get(name)

    def all_versions(self) -> int:
        """Return how often a name here, or around, came to stand for something else."""
        return self.version + (self.outer.all_versions() if self.outer else 0)

    def all_names(self) -> Iterator[str]:
        """Yield the names of this scope and those around it."""
        scope: Scope | None = self
        while scope is not None:
            yield from scope.local
            scope = scope.outer

    def copy_names(self) -> Names | None:
        """Return what the names stand for, to come back to it."""
        return None if self.names is None else dict(self.names)


def join_names(several: Iterable[Names | None]) -> Names | None:
    """Return what names stand for after one of several ways; `None` if no way ends."""
    ways = [names for names in several if names is not None]
    if len(ways) < 2:  # noqa: PLR2004
        return ways[0] if ways else None
    every = {name: None for names in ways for name in names}
    return {name: join(names.get(name, UNKNOWN) for names in ways) for name in every}


@record
class LocalNames:
    """The names that a function stores.

    Attributes:
        local: Those of its own.
        unsure: Those of its own that inner functions store, or that it stores for others.
    """

    local: frozenset[str]
    unsure: frozenset[str]


def find_local_names(
    definition: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda,
) -> LocalNames:
    """Return the names that a function stores."""
    own = list(own_nodes(definition))
    arguments = {each.arg for each in list_arguments(definition.args)}
    stored = {each.id for each in stored_names(own)} | nested_names(own) | _patterns(own)
    shared = {
        name for node in own if isinstance(node, ast.Global | ast.Nonlocal) for name in node.names
    }
    inner = {
        name
        for node in ast.walk(definition)
        if isinstance(node, ast.Nonlocal)
        for name in node.names
    }
    return LocalNames(frozenset((stored | arguments) - shared), frozenset(inner))


def own_nodes(definition: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a function, and not those of functions and classes in it."""
    body = getattr(definition, 'body', [])
    pending: list[ast.AST] = list(body) if isinstance(body, list) else [body]
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, _SCOPES):
            pending += list_children(node)


def _patterns(nodes: Iterable[ast.AST]) -> set[str]:
    found = set()
    for node in nodes:
        if isinstance(node, ast.MatchAs | ast.MatchStar) and node.name:
            found.add(node.name)
        elif isinstance(node, ast.MatchMapping) and node.rest:
            found.add(node.rest)
    return found
