"""Checks of recordings that a scenario file names: that they are there, with the topics."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from composer.language.paths import explain_absent
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator
    from pathlib import Path

    from composer.diagnostics import Diagnostic
    from composer.recordings.reading import Recording
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import LikeExpectationSpec
    from composer.yaml_text.positions import DataPath

_RULE = 'unrecorded-topic'


def check_recording_of_case(
    context: ScenarioContext, recording: Path, path: DataPath
) -> Iterator[Diagnostic]:
    """Check that a recording has topics that the system hears, of the same types."""
    content = yield from _read(context, recording, path)
    if content is None:
        return
    heard = [
        each
        for each in content.topics
        if context.has_own_end('topic', each.name, provides=False)
        and not context.has_own_end('topic', each.name, provides=True)
    ]
    if not heard:
        names = [each.name for each in content.topics]
        message = f'{recording} has no topic that the system hears and does not publish itself'
        yield context.at_value(path, _RULE, message, help=suggest('', names, 'its topics are'))
    for each in heard:
        known = context.type_of('topic', each.name)
        if known is not None and known != each.type:
            yield _conflict(context, path, each.name, each.type, known)


def check_like(context: ScenarioContext, expected: LikeExpectationSpec) -> Iterator[Diagnostic]:
    """Check that a recording has the topic that it is compared with, of the same type."""
    path = (*expected.path, 'like')
    yield from check_recorded(context, expected.recording, path, expected.topic)


def check_recorded(
    context: ScenarioContext, recording: Path, path: DataPath, topic: str
) -> Iterator[Diagnostic]:
    """Check that a recording has a topic of the system, of the same type."""
    content = yield from _read(context, recording, path)
    if content is None:
        return
    types = {each.name: each.type for each in content.topics}
    if topic not in types:
        message = f'{recording} has no messages of {topic}'
        help_text = suggest(topic, types, 'it has')
        yield context.at_value(path, _RULE, message, help=help_text)
        return
    known = context.type_of('topic', topic)
    if known is not None and known != types[topic]:
        yield _conflict(context, path, topic, types[topic], known)


def _conflict(
    context: ScenarioContext, path: DataPath, topic: str, recorded: str, known: str
) -> Diagnostic:
    found = f'is a {recorded}' if recorded else 'has no type'
    message = f"'{topic}' {found} in the recording, and is a {known} in the system"
    return context.at_value(path, 'conflicting-types', message)


def _read(
    context: ScenarioContext, recording: Path, path: DataPath
) -> Generator[Diagnostic, None, Recording | None]:
    """Yield why a recording cannot be read; return what it has."""
    from composer.recordings.reading import read_recording
    from composer.recordings.recorded_topics import RecordingError

    span = context.loaded.positions.value(path)
    if not os.path.lexists(recording):
        message = f"there is no file '{recording}'"
        help_text = explain_absent(recording, span)
        yield context.at_value(path, 'unreadable-file', message, help=help_text)
        return None
    try:
        return read_recording(recording, is_bounded=True)
    except RecordingError as error:
        yield context.at_value(path, 'unreadable-file', str(error), help=error.help)
        return None
