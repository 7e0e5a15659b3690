"""Stand-ins: what answers the services and executes the actions that the system calls."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.scenarios.stand_ins import compute_payload
from composer.scenarios.times import NANOSECONDS

if TYPE_CHECKING:
    from collections.abc import Generator

    from composer.scenarios.specs import ActionStandInSpec, GivenSpec, ServiceStandInSpec
    from composer.simulation.events import Event
    from composer.simulation.simulated_system import SimulatedSystem


class StandInAbort(ComposerError):  # noqa: N818 - nothing is wrong
    """Ends a goal as aborted."""


def serve_stand_ins(simulated: SimulatedSystem, given: GivenSpec) -> None:
    """Have services answered and actions executed as a case says."""
    for service in given.services.values():
        simulated.serve(service.service, partial(_answer, service), type=service.type)
    for action in given.actions.values():
        simulated.serve_action(
            action.action, partial(_execute, action), type=action.type, accepts=action.accepts
        )


def _answer(spec: ServiceStandInSpec, request: Any) -> Any:
    if not spec.answers:
        threading.Event().wait()
    time.sleep(spec.delay_ns / NANOSECONDS)
    return compute_payload(spec.response, 'request', request)


def _execute(spec: ActionStandInSpec, goal: Any) -> Generator[Any, None, Any]:
    elapsed_ns = 0
    for feedback in spec.feedback:
        time.sleep((feedback.delay_ns - elapsed_ns) / NANOSECONDS)
        elapsed_ns = feedback.delay_ns
        yield compute_payload(feedback.message, 'goal', goal)
    time.sleep(max(0, spec.delay_ns - elapsed_ns) / NANOSECONDS)
    if spec.status == 'aborted':
        message = 'the stand-in aborts the goal'
        raise StandInAbort(message)
    result: Any = compute_payload(spec.result, 'goal', goal)
    return result


def is_of_stand_in(event: Event) -> bool:
    """Return whether an event is the error that a stand-in aborts a goal with."""
    is_error = event.kind == 'error' or (event.kind == 'log' and event.name == 'error')
    return is_error and not event.node and StandInAbort.__name__ in str(event.value)
