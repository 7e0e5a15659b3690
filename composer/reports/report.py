"""The result of `composer check` or `composer test`, which every format shows."""

from __future__ import annotations

import shlex
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.diagnostics import has_errors
from composer.records import record
from composer.rules import Severity
from composer.scenarios.running.case_results import CaseResult
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.diagnostics import Diagnostic, Span

FindingKey: TypeAlias = 'tuple[str, int, int, str, str]'
Outcome: TypeAlias = Literal['passed', 'failed', 'error']

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
class Attempt:
    """A run of a case in a shuffled order.

    Attributes:
        difference: Where its order differs from the default one, a line each.
    """

    result: CaseResult
    difference: tuple[str, ...] = ()


@record
class CaseReport:
    """A case of a scenario file, and what came of it.

    Attributes:
        file: The scenario file, as the user named it.
        name: The name of the case; empty for a file that has errors.
        span: Where it stands in the file.
        result: What came of it in the default order.
        attempts: What came of it in other orders.
        limit_sec: The limit of real time that the command line gives; `None` for none.
        findings: The errors of the file that keep it from being run.
    """

    file: str
    name: str = ''
    span: Span | None = None
    result: CaseResult = CaseResult()
    attempts: tuple[Attempt, ...] = ()
    limit_sec: float | None = None
    findings: tuple[Diagnostic, ...] = ()

    @property
    def title(self) -> str:
        """`file::case`, as the command line takes it."""
        return f'{self.file}::{self.name}' if self.name else self.file

    @property
    def outcome(self) -> Outcome:
        """What came of it in all orders together."""
        if has_errors(self.findings):
            return 'error'
        return 'passed' if self.shown.has_passed else 'failed'

    @property
    def failing(self) -> Attempt | None:
        """The first attempt that failed, if the default order did not."""
        if not self.result.has_passed:
            return None
        failed = (attempt for attempt in self.attempts if not attempt.result.has_passed)
        return next(failed, None)

    @property
    def shown(self) -> CaseResult:
        """The result that says why it failed; that of the default order if it passed."""
        return self.failing.result if self.failing else self.result

    @property
    def real_sec(self) -> float:
        """How long all its runs took."""
        return self.result.real_sec + sum(attempt.result.real_sec for attempt in self.attempts)

    @property
    def command(self) -> str:
        """The command that runs exactly this once more."""
        words = ['composer', 'test', self.title, '--seed', str(self.shown.seed)]
        words += ['--shuffle', '1'] if self.failing else []
        words += ['--real-time-limit', f'{self.limit_sec:g}'] if self.limit_sec else []
        return shlex.join(words)


@record
class Report:
    """All that a run of `composer check` or `composer test` found.

    Attributes:
        files: The files that were checked.
        not_checked: What could not be checked on this machine, a line each.
        is_strict: Whether warnings count as errors.
        cases: In the order of the command line; `None` for `composer check`, which runs none.
        deselected: How many cases `-k` left out.
        real_sec: How long the run took.
        end: Why it ended early; empty if it did not.
    """

    files: tuple[CheckedFile, ...] = ()
    not_checked: tuple[str, ...] = ()
    is_strict: bool = False
    cases: tuple[CaseReport, ...] | None = None
    deselected: int = 0
    real_sec: float = 0.0
    end: str = ''

    @property
    def findings(self) -> list[Diagnostic]:
        """All findings, file by file; one that several files share is listed once."""
        found = [finding for file in self.files for finding in file.findings]
        return list({finding.sort_key: finding for finding in reversed(found)}.values())[::-1]

    def count(self, outcome: Outcome) -> int:
        """Return how many cases came out so."""
        return sum(case.outcome == outcome for case in self.cases or ())

    @property
    def combinations(self) -> int:
        """How many combinations were checked."""
        return sum(file.combination is not None for file in self.files)

    @property
    def has_failed(self) -> bool:
        """Whether there are errors, warnings that count as errors, or cases that did not pass."""
        if self.cases is not None:
            return any(case.outcome != 'passed' for case in self.cases)
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


def count_severities(findings: Sequence[Diagnostic]) -> tuple[int, int]:
    """Return the number of errors and of warnings."""
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    return errors, len(findings) - errors
