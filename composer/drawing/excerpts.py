"""Excerpts: the lines of a file that declare a part of the system."""

from __future__ import annotations

from collections import defaultdict
from itertools import groupby, islice
from typing import TYPE_CHECKING, NamedTuple

from composer.confidential import may_show_lines
from composer.diagnostics import relative_path

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.diagnostics import SourceFile, Span
    from composer.yaml_text.positions import DataPath, SourceMap

# The depth of `nodes: {<name>: …}`; every part lies below such an entry.
_NODE = 2
_MOST_EXCERPTS = 8


class Excerpt(NamedTuple):
    """Successive lines of a file.

    Attributes:
        file: The path as reports show it, or the `--set` option.
        first: The number of the first line, counted from 1.
        what: What the lines are of, as a timer's function; empty for a part itself.
    """

    file: str
    first: int
    lines: tuple[str, ...]
    what: str = ''


class Excerpts:
    """Finds the lines of entries."""

    def __init__(self, positions: SourceMap) -> None:
        self._positions = positions
        self._spans: dict[DataPath, list[tuple[DataPath, Span]]] = defaultdict(list)
        for path, span in positions.values.items():
            self._spans[path[:_NODE]].append((path, span))
        self._masked = dict(self._mask_environments())

    def of(self, path: DataPath) -> list[Excerpt]:
        """Return the lines of an entry: those below its key, then those elsewhere."""
        key = self._positions.key(path)
        spans = [span for at, span in self._spans[path[:_NODE]] if at[: len(path)] == path]
        last = _last_line(key, spans)
        shown = [(key.source, [*range(key.line, last + 1)])]
        elsewhere: dict[SourceFile, set[int]] = defaultdict(set)
        for span in spans:
            if span.source is not key.source or not key.line <= span.line <= last:
                elsewhere[span.source].add(span.line)
        for source, numbers in elsewhere.items():
            # Successive lines are as far from their places in the list.
            runs = groupby(enumerate(sorted(numbers)), lambda each: each[1] - each[0])
            shown += [(source, [number for _, number in run]) for _, run in runs]
        found = (self._excerpt(*each) for each in shown if may_show_lines(each[0].name))
        return [*islice(found, _MOST_EXCERPTS)]

    def _excerpt(self, source: SourceFile, numbers: list[int]) -> Excerpt:
        name = relative_path(source.name) if source.home is None else source.name
        if source.home is not None and (source, 1) in self._masked:
            name = f'{name.partition("=")[0]}=…'
        lines = (self._masked.get((source, each), source.line(each)) for each in numbers)
        return Excerpt(name, numbers[0], tuple(lines))

    def _mask_environments(self) -> Iterator[tuple[tuple[SourceFile, int], str]]:
        """Yield the lines with environment variables of processes, without their values."""
        for path, spans in list(self._spans.items()):
            if path[:1] != ('processes',):
                continue
            within = [span for at, span in spans if at[_NODE : _NODE + 1] == ('env',)]
            for span in within:
                before = span.source.line(span.line)[: span.column - 1]
                yield (span.source, span.line), f'{before}…'
            key = self._positions.keys.get((*path, 'env'))
            if key is not None:
                for number in range(key.line + 1, _last_line(key, within) + 1):
                    line = key.source.line(number)
                    yield (key.source, number), f'{line[: len(line) - len(line.lstrip())]}…'
                before = key.source.line(key.line)[: key.column - 1]
                yield (key.source, key.line), f'{before}env: …'


def _last_line(key: Span, spans: Iterable[Span]) -> int:
    """Return the last line of an entry: all lines that are indented below its key."""
    lines = key.source.lines
    if lines and key.source.line(key.line)[: key.column - 1].strip(' -?'):
        # It stands within brackets, where indentation means nothing.
        below = [span.line for span in spans if span.source is key.source]
        return max([key.line, *below])
    last = number = key.line
    while number < len(lines):
        text = key.source.line(number + 1)
        if text.strip() and len(text) - len(text.lstrip(' ')) < key.column:
            break
        number += 1
        last = number if text.strip() else last
    return last
