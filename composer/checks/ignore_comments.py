"""Comments that silence findings of their line, and comments that silence nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.rules import list_rule_names, load_rule
from composer.spelling import suggest
from composer.yaml_text.comments import read_ignore_comments

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.rules import Need
    from composer.yaml_text.comments import IgnoreComment

_READ = ('.yaml', '.yml', '.py')


def apply_ignore_comments(
    findings: Iterable[Diagnostic], source: SourceFile, unchecked: Collection[Need] | None
) -> list[Diagnostic]:
    """Return the findings that no comment silences, and the findings about the comments.

    Args:
        source: The file that was checked; findings in files that it includes count too.
        unchecked: What could not be looked at, so that nobody knows whether a comment about it
            is needed; `None` if not all findings are known.
    """
    found = list(findings)
    comments = _read_comments(found, source)
    return [
        *(finding for finding in found if not _is_silenced(finding, comments)),
        *(finding for comment in comments for finding in _check(comment, found, unchecked)),
    ]


def leave_out_silenced(findings: list[Diagnostic], source: SourceFile) -> list[Diagnostic]:
    """Return the findings that no comment silences."""
    comments = _read_comments(findings, source)
    return [finding for finding in findings if not _is_silenced(finding, comments)]


def _read_comments(findings: list[Diagnostic], source: SourceFile) -> list[IgnoreComment]:
    spans = [finding.span for finding in findings if finding.span]
    sources = {source: None} | {
        span.source: None for span in spans if span.source.name.endswith(_READ)
    }
    return [comment for each in sources for comment in read_ignore_comments(each)]


def _is_silenced(finding: Diagnostic, comments: list[IgnoreComment]) -> bool:
    return any(
        named.text == finding.rule and _is_beside(finding, named)
        for comment in comments
        for named in comment.rules
    ) and (load_rule(finding.rule).ignorable or _is_in_python(finding))


def _is_in_python(finding: Diagnostic) -> bool:
    """Return whether a finding is about code, with which a system can start."""
    return finding.file.endswith('.py')


def _is_beside(finding: Diagnostic, comment: Span) -> bool:
    span = finding.span
    return span is not None and span.source is comment.source and span.line == comment.line


def _check(
    comment: IgnoreComment, findings: list[Diagnostic], unchecked: Collection[Need] | None
) -> Iterator[Diagnostic]:
    if not comment.rules:
        yield _warn(
            comment.span,
            'unused-ignore',
            'the comment names no rule',
            'write ignore[rule], with the name of the rule',
        )
    for named in comment.rules:
        here = [f for f in findings if f.rule == named.text and _is_beside(f, named)]
        if named.text not in list_rule_names():
            advice = "'composer explain' lists them"
            help_text = suggest(named.text, list_rule_names(), otherwise=advice)
            message = f"there is no rule '{named.text}'"
            yield _warn(named, 'unknown-rule', message, help_text or advice)
        elif here and not (load_rule(named.text).ignorable or _is_in_python(here[0])):
            message = f"'{named.text}' cannot be silenced: nothing can run until it is fixed"
            yield _warn(named, 'unused-ignore', message, 'fix the error and remove the comment')
        elif not here and unchecked is not None and load_rule(named.text).needs not in unchecked:
            message = f"there is no '{named.text}' in this line to ignore"
            yield _warn(named, 'unused-ignore', message, 'remove it')


def _warn(span: Span, rule: str, message: str, help_text: str) -> Diagnostic:
    return diagnostic_at(span, rule, message, help=help_text)
