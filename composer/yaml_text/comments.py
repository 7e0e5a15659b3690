"""Comments that silence rules: `# composer: ignore[rule, rule]`, for the line they stand in."""

from __future__ import annotations

import re
import tokenize
from bisect import bisect_right
from typing import TYPE_CHECKING, Any, TypeAlias

import yaml

from composer.diagnostics import Span
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import SourceFile

_MARK = 'composer:'
_COMMENT = re.compile(r'(?:^|(?<=\s))#\s*composer:\s*ignore\b\s*(?:\[(?P<rules>[^\]]*)\])?')
# From Python 3.12 on, an f-string is several tokens.
_TEXTS = (tokenize.STRING, getattr(tokenize, 'FSTRING_MIDDLE', tokenize.STRING))
_RULE = re.compile(r'[^\s,]+')
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
# Line and column, both counted from 0.
_Place: TypeAlias = tuple[int, int]


@record
class IgnoreComment:
    """A comment that silences rules.

    Attributes:
        rules: Where each of them is named; `text` is the name.
    """

    span: Span
    rules: tuple[Span, ...]


def read_ignore_comments(source: SourceFile) -> list[IgnoreComment]:
    """Return the comments of a YAML file or Python module that silence rules.

    In a scalar or a string, one is only text. If the text is not YAML, those before the error are
    returned.
    """
    if not any(_MARK in line for line in source.lines):
        return []
    found = list(_find_candidates(source))
    if not found:
        return []
    is_python = source.name.endswith('.py')
    texts, end = _find_texts(source) if is_python else _find_scalars(source)
    starts = [start for start, _ in texts]
    read = []
    for comment in found:
        place = _place(comment.span)
        before = bisect_right(starts, place)
        if place < end and not (before and place < texts[before - 1][1]):
            read.append(comment)
    return read


def _find_candidates(source: SourceFile) -> Iterator[IgnoreComment]:
    for number, line in enumerate(source.lines, start=1):
        for match in _COMMENT.finditer(line) if _MARK in line else ():
            start = match.start('rules')
            rules = tuple(
                Span(source, number, start + rule.start() + 1, len(rule.group()))
                for rule in _RULE.finditer(match.group('rules') or '')
            )
            span = Span(source, number, match.start() + 1, match.end() - match.start())
            yield IgnoreComment(span, rules)


def _find_texts(source: SourceFile) -> tuple[list[tuple[_Place, _Place]], _Place]:
    """Return where the texts of a Python module begin and end, and where it stops being one."""
    found = []
    lines = iter([f'{line}\n' for line in source.lines])
    try:
        for token in tokenize.generate_tokens(lambda: next(lines, '')):
            if token.type in _TEXTS:
                (line, column), (last_line, last_column) = token.start, token.end
                found.append(((line - 1, column), (last_line - 1, last_column)))
    except (tokenize.TokenError, SyntaxError):
        return found, (0, 0)
    return found, (len(source.lines), 0)


def _find_scalars(source: SourceFile) -> tuple[list[tuple[_Place, _Place]], _Place]:
    """Return where scalars begin and end, in order, and where the text stops being YAML."""
    found = []
    try:
        for token in yaml.scan('\n'.join(source.lines), Loader=_Loader):
            if isinstance(token, yaml.ScalarToken):
                start = token.start_mark.line, token.start_mark.column
                if token.style in ('|', '>'):
                    # A comment may follow the indicator; the text begins on the next line.
                    start = token.start_mark.line + 1, 0
                found.append((start, (token.end_mark.line, token.end_mark.column)))
    except yaml.MarkedYAMLError as error:
        mark = error.context_mark or error.problem_mark
        return found, (mark.line, mark.column) if mark else (0, 0)
    except yaml.YAMLError:
        return found, (0, 0)
    return found, (len(source.lines), 0)


def _place(span: Span) -> _Place:
    return span.line - 1, span.column - 1
