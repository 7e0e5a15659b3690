"""The result of a check, which every format shows."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import has_errors
from composer.records import record
from composer.rules import Severity
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.diagnostics import Diagnostic

FindingKey: TypeAlias = 'tuple[str, int, int, str, str]'

# Of more combinations, the first are named.
_MOST_NAMED = 5


@record
class CheckedFile:
    """A file and its findings.

    Attributes:
        name: The path as the user wrote it.
        findings: From top to bottom, with those in the files that it includes.
        nodes: How many nodes it declares; `None` if it could not be read.
        given: The layers, arguments and settings that the command line gives it.
        combination: The name of the combination that it was checked with, if any.
        cases: How many cases a scenario file has; `None` for a system.
        crossings: What crosses between its workers and hosts, a line each.
        processes: How many external processes it declares.
    """

    name: str
    findings: tuple[Diagnostic, ...] = ()
    nodes: int | None = None
    given: str = ''
    combination: str | None = None
    cases: int | None = None
    crossings: tuple[str, ...] = ()
    processes: int = 0

    @property
    def variant(self) -> str:
        """What distinguishes it from the file as it stands; empty if nothing does."""
        return ', '.join(filter(None, (self.given, self.combination)))


@record
class Report:
    """All that a run of `composer check` found.

    Attributes:
        not_checked: What could not be checked on this machine, a line each.
        is_strict: Whether warnings count as errors.
    """

    files: tuple[CheckedFile, ...]
    not_checked: tuple[str, ...] = ()
    is_strict: bool = False

    @property
    def findings(self) -> list[Diagnostic]:
        """All findings, file by file; one that several files share is listed once."""
        found = [finding for file in self.files for finding in file.findings]
        return list({finding.sort_key: finding for finding in reversed(found)}.values())[::-1]

    @property
    def combinations(self) -> int:
        """How many combinations were checked."""
        return sum(file.combination is not None for file in self.files)

    @property
    def has_failed(self) -> bool:
        """Whether there are errors, or warnings that count as errors."""
        return has_errors(self.findings) or (self.is_strict and bool(self.findings))


def name_combinations(files: Sequence[CheckedFile]) -> list[CheckedFile]:
    """Return a file in its combinations; findings of some of them say in which they hold.

    That a comment silences nothing is a finding only if it holds in all.
    """
    named: dict[FindingKey, list[str]] = {}
    for file in files:
        for finding in file.findings:
            named.setdefault(finding.sort_key, []).append(file.combination or '')
    return [
        replace(file, findings=tuple(_with_combinations(file.findings, named, len(files))))
        for file in files
    ]


def _with_combinations(
    findings: Iterable[Diagnostic], named: Mapping[FindingKey, list[str]], total: int
) -> Iterator[Diagnostic]:
    for finding in findings:
        names = named[finding.sort_key]
        if len(names) >= total:
            yield finding
        elif finding.rule != 'unused-ignore':
            listed = ', '.join(names[:_MOST_NAMED])
            more = f' and {len(names) - _MOST_NAMED} more' if len(names) > _MOST_NAMED else ''
            yield replace(finding, message=f'{finding.message} (in {escape(listed)}{more})')


def count_severities(findings: list[Diagnostic]) -> tuple[int, int]:
    """Return the number of errors and of warnings."""
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    return errors, len(findings) - errors


def relative_path(name: str) -> str:
    """Return a path relative to the working folder if it lies in it, with forward slashes."""
    if name.startswith('<'):
        return name
    path = Path(os.path.abspath(name))  # noqa: PTH100 - `resolve` would follow links
    folder = Path.cwd()
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.as_posix()
