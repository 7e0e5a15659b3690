"""Parses what a case is given, and the parts that steps and expectations have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.parsing.full_names import absolute
from composer.scenarios.specs import (
    ActionStandInSpec,
    FeedbackSpec,
    GivenSpec,
    ScheduleSpec,
    ServiceStandInSpec,
    SourceInputSpec,
    SourceValueSpec,
    WindowSpec,
)
from composer.scenarios.times import to_nanoseconds

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from composer.scenarios.parsing.full_names import NameReader
    from composer.scenarios.specs import ValuesByNode
    from composer.yaml_text.positions import DataPath


def parse_given(
    data: Mapping[str, Any],
    path: DataPath,
    names: NameReader,
    find_recording: Callable[[str], Path],
) -> GivenSpec:
    """Return what a case starts from."""
    services = (
        parse_service_stand_in(name, entry, (*path, 'services', name))
        for name, entry in data.get('services', {}).items()
    )
    actions = (
        parse_action_stand_in(name, entry, (*path, 'actions', name))
        for name, entry in data.get('actions', {}).items()
    )
    return GivenSpec(
        parameters=parse_values(data.get('parameters', {}), names),
        recording=find_recording(data['recording']) if 'recording' in data else None,
        services={each.service: each for each in services},
        actions={each.action: each for each in actions},
        sources=tuple(
            _parse_source(name, entry, (*path, 'sources', name), find_recording)
            for name, entry in data.get('sources', {}).items()
        ),
        replace=data.get('replace', {}),
        path=path,
    )


def _parse_source(
    name: str,
    data: str | list[dict[str, Any]],
    path: DataPath,
    find_recording: Callable[[str], Path],
) -> SourceInputSpec:
    if isinstance(data, str):
        return SourceInputSpec(name, (), find_recording(data), path)
    values = (
        SourceValueSpec(parse_schedule(each), each['value'], (*path, index))
        for index, each in enumerate(data)
    )
    return SourceInputSpec(name, tuple(values), None, path)


def parse_service_stand_in(
    name: str, data: Mapping[str, Any], path: DataPath
) -> ServiceStandInSpec:
    """Return how a service is answered."""
    return ServiceStandInSpec(
        service=absolute(name),
        response=data.get('response', {}),
        delay_ns=to_nanoseconds(data.get('delay', 0)),
        answers=data.get('answers', True),
        type=data.get('type'),
        path=path,
    )


def parse_action_stand_in(name: str, data: Mapping[str, Any], path: DataPath) -> ActionStandInSpec:
    """Return how goals of an action are executed; feedback is sorted by its times."""
    feedback = [
        FeedbackSpec(to_nanoseconds(each.get('delay', 0)), each['message'])
        for each in data.get('feedback', ())
    ]
    last = max((each.delay_ns for each in feedback), default=0)
    return ActionStandInSpec(
        action=absolute(name),
        accepts=data.get('accepts', True),
        feedback=tuple(sorted(feedback, key=lambda each: each.delay_ns)),
        result=data.get('result', {}),
        status=data.get('status', 'succeeded'),
        delay_ns=to_nanoseconds(data['delay']) if 'delay' in data else last,
        type=data.get('type'),
        path=path,
    )


def parse_values(data: Mapping[str, Mapping[str, Any]], names: NameReader) -> ValuesByNode:
    """Return values by full names of nodes."""
    return {names.node(node): values for node, values in data.items()}


def parse_schedule(data: Mapping[str, Any]) -> ScheduleSpec:
    """Return when a step is done, or a value is brought."""
    every = data.get('every')
    return ScheduleSpec(
        at_ns=to_nanoseconds(data.get('at', 0)),
        every_ns=None if every is None else to_nanoseconds(every),
        times=None if 'times' not in data else int(data['times']),
    )


def parse_window(data: Mapping[str, Any], key: str = 'within') -> WindowSpec:
    """Return the window that an entry has under a key; the whole case if it has none."""
    if key not in data:
        return WindowSpec()
    start, end = data[key]
    return WindowSpec(to_nanoseconds(start), to_nanoseconds(end))
