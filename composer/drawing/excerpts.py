"""Excerpts: the lines of the files that declare a part of the system."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

from composer.confidential import may_show_lines
from composer.diagnostics import relative_path

if TYPE_CHECKING:
    from composer.diagnostics import SourceFile, Span
    from composer.yaml_text.positions import DataPath, SourceMap

# The depth of `nodes: {<name>: …}`; every part lies below such an entry.
_NODE = 2


class Excerpt(NamedTuple):
    """Successive lines of a file.

    Attributes:
        file: The path as reports show it, or the `--set` option without its value.
        first: The number of the first line, counted from 1.
        what: What the lines are of, as a timer's function; empty for a part itself.
    """

    file: str
    first: int
    lines: tuple[str, ...]
    what: str = ''


class Excerpts:
    """Finds the lines of entries; environment variables of processes are left out."""

    def __init__(self, positions: SourceMap) -> None:
        self._positions = positions
        self._spans: dict[DataPath, list[tuple[DataPath, Span]]] = defaultdict(list)
        # The column from which a line is left out.
        self._ends: dict[tuple[SourceFile, int], int] = {}
        for path, span in (*positions.keys.items(), *positions.values.items()):
            self._spans[path[:_NODE]].append((path, span))
            if path[:1] == ('processes',) and path[_NODE : _NODE + 1] == ('env',):
                for number in range(span.line, _last_line(span) + 1):
                    column = span.column if number == span.line else 1
                    before = self._ends.get((span.source, number), column)
                    self._ends[span.source, number] = min(column, before)

    def of(self, path: DataPath) -> list[Excerpt]:
        """Return the lines of an entry: those below its key, then those of other files."""
        key = self._positions.key(path)
        numbers = defaultdict(list, {key.source: [key.line, _last_line(key)]})
        for at, span in self._spans[path[:_NODE]]:
            if at[: len(path)] == path and span.source is not key.source:
                numbers[span.source].append(span.line)
        return [
            self._excerpt(source, min(lines), max(lines))
            for source, lines in numbers.items()
            if may_show_lines(source.name)
        ]

    def _excerpt(self, source: SourceFile, first: int, last: int) -> Excerpt:
        is_file = source.home is None
        name = relative_path(source.name) if is_file else source.name.partition('=')[0]
        lines = []
        for number in range(first, last + 1):
            end = self._ends.get((source, number))
            line = source.line(number)
            lines.append(line if end is None else f'{line[: end - 1]}…')
        return Excerpt(name, first, tuple(lines))


def _last_line(key: Span) -> int:
    """Return the last line of an entry: all lines that are indented below its key."""
    last = key.line
    for number, line in enumerate(key.source.lines[key.line :], key.line + 1):
        if line.strip():
            if len(line) - len(line.lstrip(' ')) < key.column:
                break
            last = number
    return last
