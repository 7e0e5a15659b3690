"""Parses the steps of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.parsing.case_parts import parse_schedule, parse_values
from composer.scenarios.parsing.full_names import absolute
from composer.scenarios.specs import (
    CallStepSpec,
    GoalStepSpec,
    NodeStepSpec,
    PublishStepSpec,
    SetParametersStepSpec,
    TopicFaultStepSpec,
)
from composer.scenarios.times import to_nanoseconds

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.scenarios.parsing.full_names import NameReader
    from composer.scenarios.specs import StepSpec
    from composer.simulation.simulated_system import NodeAction
    from composer.simulation.topic_faults import TopicFaultKind
    from composer.yaml_text.positions import DataPath

DEFAULT_TIMEOUT_SEC = 5.0


def parse_step(data: Mapping[str, Any], path: DataPath, names: NameReader) -> StepSpec:
    """Return a step."""
    if 'set_parameters' in data:
        return SetParametersStepSpec(
            schedule=parse_schedule(data),
            values=parse_values(data['set_parameters'], names),
            atomically=data.get('atomically', False),
            refused=data.get('refused', False),
            path=path,
        )
    verb = next(verb for verb in (*_VERBS, *_ACTIONS, *_FAULTS) if verb in data)
    if verb in _ACTIONS:
        return NodeStepSpec(parse_schedule(data), verb, data[verb], path)
    if verb in _FAULTS:
        return TopicFaultStepSpec(
            schedule=parse_schedule(data),
            kind=verb,
            topic=absolute(data[verb]),
            seconds=data.get('for'),
            delay_sec=float(data.get('by', 0)),
            path=path,
        )
    return _VERBS[verb](data, path)


def _parse_publish(data: Mapping[str, Any], path: DataPath) -> PublishStepSpec:
    return PublishStepSpec(
        schedule=parse_schedule(data),
        topic=absolute(data['publish']),
        message=data.get('message', {}),
        type=data.get('type'),
        path=path,
    )


def _parse_call(data: Mapping[str, Any], path: DataPath) -> CallStepSpec:
    return CallStepSpec(
        schedule=parse_schedule(data),
        service=absolute(data['call']),
        request=data.get('request', {}),
        response=data.get('response'),
        fails=data.get('fails', False),
        timeout_sec=float(data.get('timeout', DEFAULT_TIMEOUT_SEC)),
        tolerance=float(data.get('tolerance', 0)),
        type=data.get('type'),
        path=path,
    )


def _parse_goal(data: Mapping[str, Any], path: DataPath) -> GoalStepSpec:
    cancel_at = data.get('cancel_at')
    return GoalStepSpec(
        schedule=parse_schedule(data),
        action=absolute(data['send_goal']),
        goal=data.get('goal', {}),
        cancel_at_ns=None if cancel_at is None else to_nanoseconds(cancel_at),
        feedback=tuple(data['feedback']) if 'feedback' in data else None,
        result=data.get('result'),
        status=data.get('status', 'succeeded' if cancel_at is None else None),
        timeout_sec=float(data.get('timeout', DEFAULT_TIMEOUT_SEC)),
        tolerance=float(data.get('tolerance', 0)),
        type=data.get('type'),
        path=path,
    )


_ACTIONS: tuple[NodeAction, ...] = ('stop', 'kill', 'start', 'restart')
_FAULTS: tuple[TopicFaultKind, ...] = ('drop', 'delay', 'duplicate')
_VERBS: dict[str, Callable[[Mapping[str, Any], DataPath], StepSpec]] = {
    'publish': _parse_publish,
    'call': _parse_call,
    'send_goal': _parse_goal,
}
