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
        depth = len(old)
        for spans in (self.keys, self.values):
            for path in [path for path in spans if path[:depth] == old]:
                spans[new + path[depth:]] = spans.pop(path)
