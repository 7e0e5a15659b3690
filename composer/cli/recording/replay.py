"""`composer replay`: publish a recording to the ROS graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer import signals
from composer.application.running_systems.client import Client
from composer.cli.recording.record import Terminal
from composer.errors import ComposerError, ExitCode
from composer.names import count_of
from composer.recordings.reading import read_recording
from composer.recordings.topic_patterns import TopicPatterns

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.recordings.recorded_topics import RecordedTopic
    from composer.recordings.types import MessageTypes

_NANOSECONDS = 10**9
_LATEST_NS = 2**64
# Each is a publisher.
_MOST_TOPICS = 5000


def replay(
    path: Path,
    topics: Sequence[str],
    ros_arguments: Sequence[str],
    *,
    rate: float,
    start_sec: float,
    waits: bool,
    loops: bool,
) -> int:
    """Publish a recording; return the exit code.

    It is 1 if topics that are wanted cannot be published.

    Args:
        path: An MCAP file, or a folder of rosbag2.
        topics: Patterns of the topics; all if there are none.
        rate: How many times as fast as it was recorded.
        start_sec: How much of the beginning is left out.
        waits: Whether to begin only when each topic has a subscription.
        loops: Whether to begin again at the end, until it is interrupted.

    Raises:
        RosNotFoundError: There is no rclpy.
        RecordingError: There is no such recording, or it cannot be read.
        ComposerError: There is nothing to publish.
        UsageError: A pattern is empty, or the ROS arguments are wrong.
    """
    terminal, patterns = Terminal(), TopicPatterns(topics)
    recording = read_recording(path)
    if recording.problem:
        terminal.warning(f'{recording.problem}; what it has is published')
    wanted = [each for each in recording.topics if patterns.has(each.name)]
    for remark in patterns.describe_unused([each.name for each in recording.topics]):
        terminal.warning(remark)
    if len(wanted) > _MOST_TOPICS:
        message = f"'{path}' has {len(wanted):,} topics, and {_MOST_TOPICS:,} are replayed at most"
        raise ComposerError(message, help='name some with --topics')
    with signals.interrupting(), Client('_composer_replay', ros_arguments) as client:
        # These import rclpy, which the client has found.
        from composer.recordings.publishing import RecordingPublisher
        from composer.recordings.types import MessageTypes

        types = MessageTypes(wanted, terminal.info)
        problems = _describe_problems(wanted, types)
        for problem in problems:
            terminal.warning(problem)
        publisher = RecordingPublisher(client.node, wanted, types)
        if not publisher.topics:
            message = f"'{path}' has nothing to publish"
            raise ComposerError(message, help="see 'composer replay --help' for --topics")
        duration_sec = (recording.end_ns - recording.start_ns) / _NANOSECONDS
        topics_text = count_of(len(publisher.topics), 'topic')
        terminal.info(f"replaying {topics_text} of '{path}', {duration_sec:.1f} s")
        publisher.wait_for_subscriptions(of_all=waits)
        since_ns = recording.start_ns + round(min(_LATEST_NS, start_sec * _NANOSECONDS))
        count = publisher.publish(recording, since_ns, rate)
        while loops:
            count += publisher.publish(recording, since_ns, rate)
        publisher.finish()
    terminal.info(f'published {count_of(count, "message")}')
    return ExitCode.FAILED if problems else ExitCode.DONE


def _describe_problems(topics: Sequence[RecordedTopic], types: MessageTypes) -> list[str]:
    return [
        f"'{topic.name}' is not published: {problem}"
        for topic in topics
        if (problem := types.problems.get((topic.name, topic.type)))
    ]
