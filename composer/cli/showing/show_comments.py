"""Keep comments that silence rules in the output of `composer show`.

Only those are kept without which a check of the output would find more than a check of the files.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text
from composer.yaml_text.comments import read_ignore_comments

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.diagnostics import SourceFile, Span
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath, SourceMap


def find_kept_comments(system: LoadedSystem, text: str) -> dict[int, str]:
    """Return the comments to print, by line number.

    Args:
        text: The output without comments.
    """
    silenced = _find_silenced(system.positions.sources())
    if not silenced:
        return {}
    shown = load_system_text(text, system.path, [])
    places = _paths_by_line(shown.positions)
    rules: dict[int, set[str]] = defaultdict(set)
    for finding in check_system(shown, InterfaceCatalogue()):
        span = finding.span
        if span is None or span.source is not shown.positions.source:
            continue
        written = _lines_of(system.positions, places[span.line])
        if any(finding.rule in silenced.get(each, ()) for each in written):
            rules[span.line].add(finding.rule)
    return {line: f'# composer: ignore[{", ".join(sorted(rules[line]))}]' for line in rules}


def append_comments(text: str, comments: Mapping[int, str]) -> str:
    """Return a text with comments at the ends of its lines, given by line number."""
    lines = text.splitlines(keepends=True)
    for number, comment in comments.items():
        line = lines[number - 1].rstrip('\n')
        lines[number - 1] = f'{line}  {comment}\n'
    return ''.join(lines)


def _find_silenced(sources: Iterable[SourceFile]) -> dict[tuple[SourceFile, int], set[str]]:
    """Return the rules that comments name, by file and line."""
    found: dict[tuple[SourceFile, int], set[str]] = {}
    for source in sources:
        for comment in read_ignore_comments(source):
            rules = {rule.text for rule in comment.rules}
            found.setdefault((source, comment.span.line), set()).update(rules)
    return found


def _paths_by_line(positions: SourceMap) -> dict[int, list[DataPath]]:
    paths: dict[int, list[DataPath]] = defaultdict(list)
    for spans in (positions.keys, positions.values):
        for path, span in spans.items():
            paths[span.line].append(path)
    return paths


def _lines_of(positions: SourceMap, paths: Iterable[DataPath]) -> set[tuple[SourceFile, int]]:
    """Return the files and lines in which the keys and values at some paths were written."""
    spans: set[Span] = set()
    for path in paths:
        spans |= {positions.key(path), positions.value(path)}
    return {(span.source, span.line) for span in spans}
