"""A case and what happened in it → what did not come as expected."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.expectations.happenings import sort_events
from composer.scenarios.expectations.log_expectations import (
    check_error,
    check_exit,
    check_log,
    check_unexpected_errors,
    check_unexpected_exit,
)
from composer.scenarios.expectations.node_expectations import check_parameters, check_state
from composer.scenarios.expectations.step_expectations import check_outcome, check_undone
from composer.scenarios.expectations.topic_expectations import (
    check_like,
    check_messages,
    check_order,
    check_rate,
)
from composer.scenarios.specs import (
    ErrorExpectationSpec,
    ExitExpectationSpec,
    LikeExpectationSpec,
    LogExpectationSpec,
    MessageExpectationSpec,
    OrderExpectationSpec,
    ParametersExpectationSpec,
    RateExpectationSpec,
    StateExpectationSpec,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from composer.scenarios.expectations.failures import Failure
    from composer.scenarios.expectations.happenings import Happenings
    from composer.scenarios.outcomes import Outcome
    from composer.scenarios.specs import CaseSpec, ValuesByNode
    from composer.simulation.events import Event

_CHECKS: dict[type, Callable[[Any, Happenings], Iterator[Failure]]] = {
    MessageExpectationSpec: check_messages,
    RateExpectationSpec: check_rate,
    OrderExpectationSpec: check_order,
    LikeExpectationSpec: check_like,
    LogExpectationSpec: check_log,
    ErrorExpectationSpec: check_error,
    ParametersExpectationSpec: check_parameters,
    StateExpectationSpec: check_state,
    ExitExpectationSpec: check_exit,
}


def evaluate(
    case: CaseSpec,
    events: Sequence[Event],
    outcomes: Sequence[Outcome] = (),
    *,
    parameters: ValuesByNode | None = None,
) -> list[Failure]:
    """Return what did not come as expected: errors first, then steps, then expectations.

    Args:
        events: What happened, in its order.
        outcomes: What came of the steps that were done.
        parameters: The values that parameters started with, by full names of nodes.
    """
    happened = sort_events(events, outcomes, case.until_ns, parameters)
    failures = [*check_unexpected_errors(case, happened), *check_unexpected_exit(case, happened)]
    for outcome in outcomes:
        failures += check_outcome(outcome)
    failures += check_undone(case, happened)
    for expected in case.expectations:
        failures += _CHECKS[type(expected)](expected, happened)
    return failures
