"""Where each key and value was written, keyed by its path in the data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from composer.diagnostics import SourceFile, Span

Key: TypeAlias = str | int
DataPath: TypeAlias = tuple[Key, ...]


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
        """Return the span of the key at `path`, or of the nearest thing around it."""
        return self.keys.get(path) or self.value(path)

    def value(self, path: DataPath) -> Span:
        """Return the span of the value at `path`, or of the nearest thing around it."""
        while path not in self.values and path:
            path = path[:-1]
            if path in self.keys:
                return self.keys[path]
        return self.values.get(path) or Span(self.source, 1, 1, 0)

    def move(self, old: DataPath, new: DataPath) -> None:
        """Let what was at `old`, and all below it, be found at `new`."""
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
        """Note what lies directly below each path, so that moves pass over all else."""
        self._inner.clear()
        for path in dict.fromkeys([*self.keys, *self.values]):
            self._inner.setdefault(path[:-1], []).append(path)
