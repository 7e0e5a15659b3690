"""What is asked of the process of a case, and what came of it: plain data that can be sent."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Span

FailureKind: TypeAlias = Literal['expectation', 'step', 'behaviour', 'start', 'stuck', 'died']


@record
class CaseRequest:
    """One run of a case.

    Attributes:
        file: The scenario file, as it is to be shown.
        case: Its name.
        seed: What random choices depend on; `None` for the seed of the case.
        shuffle: 0 for the default order. Of another legal order, the number: the seed of the
            first is that of the case, of the next one more, and so on.
        real_time_limit_sec: The run is ended after so much real time; `None` for what the case
            says.
        trace: A file to write each event to; empty for none.
        timeline: A file to write what callbacks did to, as JSON; empty for none.
        captures: Whether to keep what behaviours print, instead of showing it.
    """

    file: str
    case: str
    seed: int | None = None
    shuffle: int = 0
    real_time_limit_sec: float | None = None
    trace: str = ''
    timeline: str = ''
    captures: bool = True


@record
class CaseFailure:
    """Something that makes a case fail.

    Attributes:
        message: What is wrong, in one line.
        span: The place in the scenario file; `None` for what has none.
        difference: What was expected and what came, a line each.
        around: The events around that moment, a line each.
        stack: A traceback, or the stacks of all threads; may be empty.
    """

    kind: FailureKind
    message: str
    span: Span | None = None
    difference: tuple[str, ...] = ()
    around: tuple[str, ...] = ()
    stack: str = ''


@record
class CaseResult:
    """What came of one run of a case.

    Attributes:
        failures: Empty if it passed.
        seed: The seed that it ran with.
        real_sec: How long it took.
        simulated_sec: How much virtual time passed.
        notices: What makes it not repeatable, a line each.
        log: The lines of the system's log, with their times.
        output: What was printed, on standard output.
        errors: The same on standard error, without the log.
    """

    failures: tuple[CaseFailure, ...] = ()
    seed: int = 0
    real_sec: float = 0.0
    simulated_sec: float = 0.0
    notices: tuple[str, ...] = ()
    log: tuple[str, ...] = ()
    output: str = ''
    errors: str = ''

    @property
    def has_passed(self) -> bool:
        """Whether nothing failed."""
        return not self.failures

    def with_failure(self, failure: CaseFailure) -> CaseResult:
        """Return the same result with one more failure."""
        return replace(self, failures=(*self.failures, failure))
