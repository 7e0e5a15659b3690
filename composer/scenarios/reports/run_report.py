"""The result of a test run, which every format shows."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.diagnostics import has_errors
from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.scenarios.running.case_results import CaseResult

Outcome: TypeAlias = Literal['passed', 'failed', 'error']


@record
class Attempt:
    """A run of a case in a shuffled order.

    Attributes:
        difference: Where its order differs from the default one, a line each; empty if it is the
            same, or it passed.
        differs: Whether its order differs from the default one.
    """

    result: CaseResult
    difference: tuple[str, ...] = ()
    differs: bool = False


@record
class CaseReport:
    """What came of a case.

    Attributes:
        file: The scenario file, as it is to be shown.
        name: The name of the case; empty for a file that has errors.
        span: Where it stands in the file.
        result: What came of it in the default order.
        attempts: What came of it in other orders.
        limit_sec: The limit of real time that the command line gives; `None` for none.
        findings: The errors of the file that keep it from being run.
    """

    file: str
    name: str
    span: Span | None
    result: CaseResult
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
        is_good = self.result.has_passed and all(each.result.has_passed for each in self.attempts)
        return 'passed' if is_good else 'failed'

    @property
    def failing(self) -> Attempt | None:
        """The first attempt that failed, if the default order did not."""
        if not self.result.has_passed:
            return None
        return next((each for each in self.attempts if not each.result.has_passed), None)

    @property
    def shown(self) -> CaseResult:
        """The result that says why it failed; that of the default order if it passed."""
        return self.failing.result if self.failing else self.result

    @property
    def real_sec(self) -> float:
        """How long all its runs took."""
        return self.result.real_sec + sum(each.result.real_sec for each in self.attempts)

    @property
    def command(self) -> str:
        """The command that runs exactly this once more."""
        words = ['composer', 'test', self.title, '--seed', str(self.shown.seed)]
        words += ['--shuffle', '1'] if self.failing else []
        words += ['--real-time-limit', f'{self.limit_sec:g}'] if self.limit_sec else []
        return shlex.join(words)


@record
class RunReport:
    """All that a run of `composer test` did.

    Attributes:
        cases: In the order of the command line.
        findings: What was found in the files, warnings included.
        deselected: How many cases `-k` left out.
        real_sec: How long it took.
        end: Why it ended early; empty if it did not.
    """

    cases: tuple[CaseReport, ...]
    findings: tuple[Diagnostic, ...] = ()
    deselected: int = 0
    real_sec: float = 0.0
    end: str = ''

    def count(self, outcome: Outcome) -> int:
        """Return how many cases came out so."""
        return sum(case.outcome == outcome for case in self.cases)

    @property
    def has_failed(self) -> bool:
        """Whether something did not pass."""
        return any(case.outcome != 'passed' for case in self.cases)
