"""Findings as data: what is wrong, where, and what to do about it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from composer.confidential import conceal
from composer.records import record
from composer.rules import Severity, load_rule
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Unpack


_LONGEST = 2000


@dataclass(frozen=True, slots=True, eq=False)
class SourceFile:
    """The text of a file as it was read.

    Attributes:
        name: The path as the user wrote it, for display.
        lines: The lines without their ends.
        home: The folder for relative paths in a text of the command line; `None` for a file.
    """

    name: str
    lines: tuple[str, ...]
    home: str | None = None

    @property
    def folder(self) -> Path:
        """The folder for relative paths in it; of a symbolic link, that of its target."""
        if self.home is not None:
            return Path(self.home)
        # As Path.is_symlink and Path.resolve, but for any name.
        is_link = os.path.islink(self.name)  # noqa: PTH114
        return Path(os.path.realpath(self.name) if is_link else self.name).parent

    def line(self, number: int) -> str:
        """Return line `number`, counted from 1; an empty string past the end."""
        return self.lines[number - 1] if 0 < number <= len(self.lines) else ''


@record
class Span:
    """A part of one line.

    Attributes:
        source: Its file.
        line: Counted from 1.
        column: The column of its first character, counted from 1.
        length: In characters; 0 where a value is missing.
    """

    source: SourceFile
    line: int
    column: int
    length: int = 1

    @property
    def text(self) -> str:
        """The characters that the span covers."""
        start = self.column - 1
        return self.source.line(self.line)[start : start + self.length]

    @property
    def place(self) -> str:
        """`file:line`, or the option of the command line that it is from."""
        is_file = self.source.home is None
        return f'{self.source.name}:{self.line}' if is_file else self.source.name

    def narrowed_to(self, part: str, *, first: bool = False) -> Span:
        """Return the span of the last (or `first`) `part` within this one; this one if none."""
        find = self.text.find if first else self.text.rfind
        start = find(part) if part else -1
        if start < 0:
            return self
        return Span(self.source, self.line, self.column + start, len(part))

    def __str__(self) -> str:
        """Return `file:line:column`."""
        return f'{self.source.name}:{self.line}:{self.column}'


@record
class Related:
    """Another place that a finding mentions."""

    message: str
    span: Span

    def __post_init__(self) -> None:
        """Hide what must not be shown."""
        object.__setattr__(self, 'message', conceal(self.message))


@record
class Diagnostic:
    """One finding.

    Attributes:
        rule: The rule's stable name, as in `unknown-key`.
        message: What is wrong and what was expected, in one line.
        file: The name of the file; also for a finding without a line, as in an unreadable file.
        span: The text that it is about.
        help: What to do about it.
        related: Other places that it mentions.
    """

    rule: str
    message: str
    file: str
    span: Span | None = None
    help: str | None = None
    related: tuple[Related, ...] = field(default=())

    def __post_init__(self) -> None:
        """Hide what must not be shown."""
        object.__setattr__(self, 'message', conceal(self.message))
        object.__setattr__(self, 'help', self.help and conceal(self.help))

    def with_related(self, related: Iterable[Related]) -> Diagnostic:
        """Return the same finding with more related places."""
        return replace(self, related=(*self.related, *related))

    @property
    def severity(self) -> Severity:
        """The severity of its rule."""
        return load_rule(self.rule).severity

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """Files by name, then from top to bottom."""
        line, column = (self.span.line, self.span.column) if self.span else (0, 0)
        return self.file, line, column, self.rule, self.message


class Remarks(TypedDict, total=False):
    """The optional parts of a finding; see `Diagnostic`."""

    help: str | None
    related: Iterable[Related]


def diagnostic_at(span: Span, rule: str, message: str, **remarks: Unpack[Remarks]) -> Diagnostic:
    """Return a finding whose file is that of its span.

    Long texts are cut, and characters that a terminal cannot show become escapes: messages quote
    the file, which may hold anything.
    """
    advice = remarks.get('help')
    return Diagnostic(
        rule,
        _printable(message),
        span.source.name,
        span,
        advice and _printable(advice),
        tuple(remarks.get('related', ())),
    )


def _printable(text: str) -> str:
    if len(text) > _LONGEST:
        text = f'{text[: _LONGEST // 2]}…{text[-_LONGEST // 2 :]}'
    return escape(text)


def errors_first(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return findings with the errors before the warnings: only the first may be shown."""
    return sorted(diagnostics, key=lambda each: each.severity is not Severity.ERROR)


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Return whether any of the findings is an error."""
    return any(diagnostic.severity is Severity.ERROR for diagnostic in diagnostics)


def relative_path(name: str) -> str:
    """Return a path relative to the working folder if it lies in it, with forward slashes."""
    if name.startswith('<'):
        return name
    # With `pathlib`, thousands of them take a second.
    path, folder = os.path.abspath(name), os.getcwd()  # noqa: PTH100, PTH109
    if path == folder:
        return os.curdir
    return path.removeprefix(os.path.join(folder, '')).replace(os.sep, '/')  # noqa: PTH118


def describe_finding(finding: Diagnostic) -> dict[str, Any]:
    """Return a finding as plain data."""
    span = finding.span
    return {
        'rule': finding.rule,
        'severity': finding.severity.value,
        'message': finding.message,
        'help': finding.help,
        'file': relative_path(finding.file) if finding.file else None,
        'line': span.line if span else None,
        'column': span.column if span else None,
    }
