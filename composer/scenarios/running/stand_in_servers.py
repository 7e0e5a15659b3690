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


# Of the time that callbacks get at the stop.
_SHARE = 0.9


class StandInAbort(ComposerError):  # noqa: N818 - nothing is wrong
    """Ends a goal as aborted, or a request without an answer."""


class StandIns:
    """Answers services and executes actions as a case says.

    Args:
        shutdown_timeout_sec: What running callbacks get to end when the system stops.
    """

    def __init__(
        self, simulated: SimulatedSystem, given: GivenSpec, shutdown_timeout_sec: float
    ) -> None:
        self._simulated = simulated
        self._given = given
        # Who calls may still wait for the answer, and gives up before.
        self._patience_sec = _SHARE * shutdown_timeout_sec
        self._has_ended = threading.Event()

    def serve(self) -> None:
        """Begin to answer."""
        for service in self._given.services.values():
            answer = partial(self._answer, service)
            self._simulated.serve(service.service, answer, type=service.type)
        for action in self._given.actions.values():
            self._simulated.serve_action(
                action.action,
                partial(_execute, action),
                type=action.type,
                accepts=action.accepts,
            )

    def end(self) -> None:
        """Give up requests that are never answered, which the stop would wait for."""
        self._has_ended.set()

    def _answer(self, spec: ServiceStandInSpec, request: Any) -> Any:
        if not spec.answers:
            self._has_ended.wait()
            time.sleep(self._patience_sec)
            message = 'the stand-in never answers'
            raise StandInAbort(message)
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
    """Return whether an event is an error that a stand-in raises on purpose."""
    is_error = event.kind == 'error' or (event.kind == 'log' and event.name == 'error')
    return is_error and not event.node and StandInAbort.__name__ in str(event.value)
