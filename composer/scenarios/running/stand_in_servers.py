"""Stand-ins: what answers the services and executes the actions that the system calls."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any

from jinja2 import StrictUndefined

from composer.errors import ComposerError
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.sandbox import Sandbox
from composer.expressions.scanner import OPEN, code_of, find_expressions
from composer.scenarios.fields import explain_error, view_fields, without_views
from composer.scenarios.times import NANOSECONDS
from composer.yaml_text.scalars import format_scalar

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


class PayloadError(ComposerError):
    """An expression of a stand-in cannot be evaluated."""


def compute_payload(data: Any, name: str, message: Any) -> Any:
    """Return data with the values of all expressions in place.

    A text that is one whole expression becomes its value, of any type.

    Args:
        name: What the message is called in expressions: `request` or `goal`.

    Raises:
        PayloadError: An expression cannot be evaluated.
    """
    if isinstance(data, dict):
        return {key: compute_payload(value, name, message) for key, value in data.items()}
    if isinstance(data, list):
        return [compute_payload(item, name, message) for item in data]
    if not isinstance(data, str) or OPEN not in data:
        return data
    return _compute_text(data, {name: view_fields(message)})


def _value_of(sandbox: Sandbox, code: str, scope: dict[str, Any]) -> Any:
    value = evaluate_expression(sandbox, code, scope)
    if isinstance(value, StrictUndefined):
        str(value)  # raises what is undefined
    return without_views(value)


def _compute_text(text: str, scope: dict[str, Any]) -> Any:
    sandbox = Sandbox()
    try:
        expressions = list(find_expressions(text, sandbox))
        values = [_value_of(sandbox, code_of(text, each), scope) for each in expressions]
    except Exception as error:
        message = f'{text!r}: {explain_error(error)}'
        raise PayloadError(message) from error
    first = expressions[0]
    if len(expressions) == 1 and not (text[: first.start] + text[first.stop :]).strip():
        return values[0]
    parts, start = [], 0
    for expression, value in zip(expressions, values, strict=True):
        parts += [text[start : expression.start], format_scalar(value)]
        start = expression.stop
    return ''.join([*parts, text[start:]])
