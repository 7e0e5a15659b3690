"""The watch of a topic, tick by tick, in a time that the test sets."""

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray

from behaviours.monitor import count, diagnose, watch
from composer.runtime.messages.payloads import converter_for

pytestmark = pytest.mark.ros


class Watched:
    """A watch that is ticked once a second, with so many messages before each tick."""

    def __init__(self, behaviour_node, set_time, watch, **limits):
        self._face, self._set_time = behaviour_node, set_time
        self.time = 100.0
        set_time(self.time)
        self._ticks = watch(behaviour_node, 'scan', **limits)

    def tick(self, messages=0):
        for n in range(messages):
            self._set_time(self.time + (n + 1) / (messages + 1))
            count(self._face, None, 'scan')
        self.time += 1.0
        self._set_time(self.time)
        return next(self._ticks)


def test_the_first_tick_begins_the_watch_and_says_nothing(behaviour_node, set_time):
    watched = Watched(behaviour_node, set_time, watch, minimum_rate=5.0)
    assert watched.tick(messages=1) is None
    assert watched.tick(messages=5) is True
    assert watched.tick(messages=4) is False
    assert watched.tick(messages=6) is True


def test_a_topic_is_stale_when_its_last_message_is_too_old(behaviour_node, set_time):
    watched = Watched(behaviour_node, set_time, watch, maximum_age=2.0)
    assert watched.tick(messages=1) is None
    assert [watched.tick() for _ in range(3)] == [True, False, False]
    assert watched.tick(messages=1) is True


def test_a_topic_that_was_never_heard_is_stale_after_a_while(behaviour_node, set_time):
    watched = Watched(behaviour_node, set_time, watch, maximum_age=2.0)
    assert [watched.tick() for _ in range(4)] == [None, True, True, False]


def test_diagnostics_tell_rate_age_and_finding(behaviour_node, set_time):
    watched = Watched(behaviour_node, set_time, diagnose, minimum_rate=5.0, maximum_age=2.0)
    watched.tick()
    told = []
    for messages in (8, 1):
        array = converter_for(DiagnosticArray).convert(watched.tick(messages))
        (status,) = array.status
        values = {value.key: value.value for value in status.values}
        told.append((status.level, status.name, status.message, values))

    assert told == [
        (b'\x00', '/node: scan', 'OK', {'rate (Hz)': '8', 'age (s)': '0.111'}),
        (
            b'\x01',
            '/node: scan',
            '1 messages/s, at least 5 expected',
            {'rate (Hz)': '1', 'age (s)': '0.5'},
        ),
    ]
    assert array.header.stamp.sec == 103
