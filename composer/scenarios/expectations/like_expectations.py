"""`like`: a topic as it was recorded."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.scenarios.expectations.diffs import render_differences, show_value
from composer.scenarios.expectations.failures import Failure
from composer.scenarios.expectations.matching import Comparison
from composer.scenarios.expectations.wording import at_time, count_of
from composer.scenarios.specs import WindowSpec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.scenarios.expectations.happenings import Happenings
    from composer.scenarios.specs import LikeExpectationSpec

# The first messages that differ are shown.
_MOST_SHOWN = 3


def check_like(expected: LikeExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that a topic has the messages that were recorded, in their order."""
    # Most cases compare nothing with a recording.
    from composer.recordings.reading import read_recording
    from composer.recordings.recorded_topics import RecordingError

    at = (*expected.path, 'like')
    try:
        recording = read_recording(expected.recording)
        recorded = [each for _, _, each in recording.messages([expected.topic])]
    except RecordingError as error:
        yield Failure(at, str(error))
        return
    if not any(each.name == expected.topic for each in recording.topics):
        yield Failure(at, f'{expected.recording} has no messages of {expected.topic}')
        return
    yield from compare_messages(expected, recorded, happened)


def compare_messages(
    expected: LikeExpectationSpec, recorded: list[Any], happened: Happenings
) -> Iterator[Failure]:
    """Compare the messages of a topic with those that were recorded."""
    found = list(happened.of_topic(expected.topic, WindowSpec()))
    ignored = frozenset(tuple(each.split('.')) for each in expected.ignored)
    comparison = Comparison(expected.tolerance, ignored)
    pairs = enumerate(zip(recorded, found, strict=False), start=1)
    differing = (
        (number, each, differences)
        for number, (wanted, each) in pairs
        if (differences := list(comparison.find_differences(wanted, each.message)))
    )
    names = (expected.topic,)
    at = (*expected.path, 'like')
    for number, each, differences in islice(differing, _MOST_SHOWN):
        message = f'message {number} on {expected.topic}{at_time(each.time_ns)} is not as recorded'
        yield Failure(at, message, render_differences(differences), each.time_ns, names)
    if len(recorded) != len(found):
        message = (
            f'{expected.topic} has {count_of(len(found), "message")}, '
            f'and {count_of(len(recorded), "message")} in the recording'
        )
        is_longer = len(found) > len(recorded)
        time = found[len(recorded)].time_ns if is_longer else happened.end_ns
        odd = found[len(recorded)].message if is_longer else recorded[len(found)]
        diff = f'{"+" if is_longer else "-"} {show_value(odd)}'
        yield Failure(at, message, diff, time, names)
