"""What came of the steps of a case, as who runs it saw it; expectations compare it."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from composer.scenarios.specs import StepSpec


@record
class Outcome:
    """What came of a step; of one that is repeated, there is one for each time.

    Attributes:
        time_ns: When the step was done, in virtual time since the start.
        end_ns: When it was answered, refused or given up; `None` if the case ended before.
        answer: The response of a service, or the result of a goal, as messages; `None` if there
            is none. Of parameters, those that are set, in words.
        status: How a goal ended: `succeeded`, `aborted`, `canceled` or `rejected`; `None` if the
            case ended before.
        feedback: The feedback messages of a goal.
        problem: Why there is no answer, or why parameters were refused, in words; `None` if
            nothing went wrong.
    """

    step: StepSpec
    time_ns: int
    end_ns: int | None = None
    answer: Any = None
    status: str | None = None
    feedback: tuple[Any, ...] = field(default=())
    problem: str | None = None
