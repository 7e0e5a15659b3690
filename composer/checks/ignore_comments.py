"""Comments that silence findings of their line, and comments that silence nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import Diagnostic, SourceFile, Span, diagnostic_at
from composer.rules import list_rule_names, load_rule
from composer.spelling import suggest
from composer.yaml_text.comments import read_ignore_comments

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from composer.rules import Need
    from composer.yaml_text.comments import IgnoreComment

_READ = ('.yaml', '.yml', '.py')
# A file, a line of it, and a rule.
_Place: TypeAlias = tuple[SourceFile, int, str]


class IgnoreComments:
    """The comments that silence findings, of the file that is checked and of those it includes.

    Attributes:
        source: The file that is checked. The comments of others are read with the first finding
            in them.
    """

    def __init__(self, source: SourceFile) -> None:
        self._comments: dict[SourceFile, list[IgnoreComment]] = {}
        self._places: set[_Place] = set()
        self._met: set[_Place] = set()
        self._read(source)

    def silence(self, finding: Diagnostic) -> bool:
        """Return whether a comment silences a finding."""
        span = finding.span
        if span is None:
            return False
        if span.source.name.endswith(_READ):
            self._read(span.source)
        place = (span.source, span.line, finding.rule)
        if place not in self._places:
            return False
        self._met.add(place)
        return _may_be_silenced(span.source, finding.rule)

    def check(self, unchecked: Collection[Need] | None) -> Iterator[Diagnostic]:
        """Yield the findings about the comments, when `silence` was asked about all others.

        Args:
            unchecked: What could not be looked at, so that nobody knows whether a comment about
                it is needed; `None` if not all findings are known.
        """
        for comments in self._comments.values():
            for comment in comments:
                if not comment.rules:
                    yield _warn(
                        comment.span,
                        'unused-ignore',
                        'the comment names no rule',
                        'write ignore[rule], with the name of the rule',
                    )
                for named in comment.rules:
                    yield from self._check(named, unchecked)

    def _read(self, source: SourceFile) -> None:
        if source not in self._comments:
            self._comments[source] = read_ignore_comments(source)
            self._places |= {
                _place(named) for each in self._comments[source] for named in each.rules
            }

    def _check(self, named: Span, unchecked: Collection[Need] | None) -> Iterator[Diagnostic]:
        rule = named.text
        if rule not in list_rule_names():
            advice = "'composer explain' lists them"
            help_text = suggest(rule, list_rule_names(), otherwise=advice)
            yield _warn(named, 'unknown-rule', f"there is no rule '{rule}'", help_text or advice)
        elif _place(named) in self._met:
            if not _may_be_silenced(named.source, rule):
                message = f"'{rule}' cannot be silenced: nothing can run until it is fixed"
                yield _warn(
                    named, 'unused-ignore', message, 'fix the error and remove the comment'
                )
        elif 'types' in (unchecked or ()) and named.source.name.endswith('.py'):
            return
        elif unchecked is not None and load_rule(rule).needs not in unchecked:
            message = f"there is no '{rule}' in this line to ignore"
            yield _warn(named, 'unused-ignore', message, 'remove it')


def _place(named: Span) -> _Place:
    return named.source, named.line, named.text


def _may_be_silenced(source: SourceFile, rule: str) -> bool:
    """Return whether a comment may silence a rule; with wrong code, a system can start."""
    return load_rule(rule).ignorable or source.name.endswith('.py')


def _warn(span: Span, rule: str, message: str, help_text: str) -> Diagnostic:
    return diagnostic_at(span, rule, message, help=help_text)
