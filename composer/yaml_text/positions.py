"""Where each key and value was written, keyed by its path in the data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import SourceFile, Span
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection

Key: TypeAlias = str | int
DataPath: TypeAlias = tuple[Key, ...]


@record
class Branch:
    """The positions of one entry and of all below it, by their paths from there."""

    keys: tuple[tuple[DataPath, Span], ...]
    values: tuple[tuple[DataPath, Span], ...]

    def only(self, keys: Collection[Key]) -> Branch:
        """Return the positions of some of the entry's own keys, and of all below these."""
        parts = (
            tuple(each for each in spans if each[0] and each[0][0] in keys)
            for spans in (self.keys, self.values)
        )
        return Branch(*parts)

    def inner(self, section: Key) -> dict[Key, Branch]:
        """Return the positions of the entries of a mapping in this entry, by their keys."""
        keys = _grouped(dict(self.keys), (section,), 1)
        values = _grouped(dict(self.values), (section,), 1)
        return _branches(keys, values)


@dataclass(slots=True)
class SourceMap:
    """The positions of a document.

    Attributes:
        keys: The span of each mapping key, by the path of its value.
        values: The span of each value, by its path.
    """

    source: SourceFile
    keys: dict[DataPath, Span] = field(default_factory=dict)
    values: dict[DataPath, Span] = field(default_factory=dict)
    _inner: dict[DataPath, list[DataPath]] = field(default_factory=dict, init=False, repr=False)
    _indexed: int = field(default=0, init=False, repr=False)

    def key(self, path: DataPath) -> Span:
        """Return the span of the key at `path`, or of the nearest key or value around it."""
        return self.keys.get(path) or self.value(path)

    def value(self, path: DataPath) -> Span:
        """Return the span of the value at `path`, or of the nearest key or value around it."""
        while path not in self.values and path:
            path = path[:-1]
            if path in self.keys:
                return self.keys[path]
        return self.values.get(path) or Span(self.source, 1, 1, 0)

    def move(self, old: DataPath, new: DataPath) -> None:
        """Move the positions at `old` and below it to `new`."""
        if self._indexed != len(self.keys) + len(self.values):
            self._index()
        depth = len(old)
        pending = [old]
        while pending:
            path = pending.pop()
            moved = new + path[depth:]
            for spans in (self.keys, self.values):
                if path in spans:
                    spans[moved] = spans.pop(path)
            inner = self._inner.pop(path, ())
            pending += inner
            self._inner.setdefault(moved, []).extend(new + each[depth:] for each in inner)
        self._inner.setdefault(new[:-1], []).append(new)
        self._indexed = len(self.keys) + len(self.values)

    def _index(self) -> None:
        """Note what lies directly below each path, which makes moves fast."""
        self._inner.clear()
        for path in dict.fromkeys([*self.keys, *self.values]):
            self._inner.setdefault(path[:-1], []).append(path)

    def branches(self, path: DataPath) -> dict[Key, Branch]:
        """Return the positions of all entries of the mapping at `path`, by their keys."""
        depth = len(path)
        keys = _grouped(self.keys, path, depth)
        values = _grouped(self.values, path, depth)
        return _branches(keys, values)

    def branch(self, path: DataPath) -> Branch:
        """Return the positions of the entry at `path`."""
        return self.branches(path[:-1])[path[-1]]

    def copy(self) -> SourceMap:
        """Return an independent copy."""
        return SourceMap(self.source, dict(self.keys), dict(self.values))

    def sources(self) -> set[SourceFile]:
        """Return all files that a position lies in."""
        return {span.source for span in self.values.values()} | {self.source}

    def remove(self, path: DataPath) -> None:
        """Forget what is at `path` and below it."""
        self._indexed = -1
        depth = len(path)
        for spans in (self.keys, self.values):
            for at in [at for at in spans if at[:depth] == path]:
                del spans[at]

    def replace(self, path: DataPath, other: SourceMap) -> None:
        """Replace the positions at `path` and below it with those of another map."""
        self.remove(path)
        self.graft(path, other.branch(path))

    def graft(self, path: DataPath, branch: Branch) -> None:
        """Add the positions of a branch at `path`."""
        self._indexed = -1
        self.keys.update((path + rest, span) for rest, span in branch.keys)
        self.values.update((path + rest, span) for rest, span in branch.values)


def _branches(
    keys: dict[Key, list[tuple[DataPath, Span]]], values: dict[Key, list[tuple[DataPath, Span]]]
) -> dict[Key, Branch]:
    return {
        key: Branch(tuple(keys.get(key, ())), tuple(values.get(key, ())))
        for key in {**keys, **values}
    }


def _grouped(
    spans: dict[DataPath, Span], path: DataPath, depth: int
) -> dict[Key, list[tuple[DataPath, Span]]]:
    groups: dict[Key, list[tuple[DataPath, Span]]] = {}
    for at, span in spans.items():
        if len(at) > depth and at[:depth] == path:
            groups.setdefault(at[depth], []).append((at[depth + 1 :], span))
    return groups
