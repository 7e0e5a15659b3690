"""Whether messages are handed over or sent, the same come, in the same order, and are dropped.

`python -m tests.runtime.messages.test_local_delivery SEED COUNT` plays more scenarios.
"""

import os
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.language.specs import QosSpec
from composer.network.transport_profile import PROFILE, PROFILE_VARIABLES
from composer.runtime.messages.delivery_policies import may_be_late, why_sent
from composer.runtime.messages.qos_profiles import create_qos_profile
from tests.runtime.messages.outsider import Outsider
from tests.runtime.messages.player import play
from tests.runtime.messages.scenarios import create_scenario

pytestmark = pytest.mark.ros


def compare(scenario, folder, outsider):
    """Play a scenario both ways; return how many messages were handed over."""
    sent = play(scenario, folder, outsider, is_local=False)
    local = play(scenario, folder, outsider, is_local=True)
    assert sent.handed_over == 0
    for name, end in scenario.subscriptions.items():
        expected, found = sent.heard[name], local.heard[name]
        told = (scenario.seed, name, end, expected, found)
        if end.group == 'reentrant':
            expected, found = sorted(expected), sorted(found)
        if end.topic in local.mixed:
            # Only the order of each publisher is promised.
            assert by_publisher(expected) == by_publisher(found), told
        else:
            assert expected == found, told
    assert sent.overruns == local.overruns, scenario.seed
    for outcome in (sent, local):
        for name, heard in outcome.stays:
            check_stay(heard, (scenario.seed, name))
    return local.handed_over


def check_stay(heard, visitor):
    """Check that a visitor got messages in order, numbered as their publishers sent them."""
    offsets, last = {}, {}
    for text, sequence_number in heard:
        publisher, number = text.split(':')
        number = int(number)
        told = visitor, publisher, last.get(publisher), text, sequence_number
        # The publisher counts what it sends: that was every message.
        offset = number - sequence_number
        assert offsets.setdefault(publisher, offset) == offset, told
        assert number > last.get(publisher, 0), told
        last[publisher] = number


def by_publisher(texts):
    found = defaultdict(list)
    for text in texts:
        publisher, number = text.split(':')
        found[publisher].append(int(number))
    return dict(found)


@pytest.fixture
def outsider(domain_id):
    outsider = Outsider(domain_id)
    yield outsider
    outsider.close()


@pytest.mark.parametrize(
    'seeds', [range(1, 4), pytest.param(range(4, 8), marks=pytest.mark.long)], ids=str
)
def test_both_ways_deliver_and_drop_the_same(tmp_path, outsider, seeds):
    handed_over = sum(compare(create_scenario(seed), tmp_path, outsider) for seed in seeds)
    assert handed_over > 12 * len(seeds)


@pytest.mark.parametrize(
    ('policies', 'expected'),
    [
        ({}, ''),
        ({'history': 'keep_all'}, ''),
        ({'history': 'system_default'}, 'history: system_default'),
        ({'reliability': 'best_effort'}, ''),
        ({'reliability': 'system_default'}, 'reliability: system_default'),
        ({'reliability': 'best_available'}, 'reliability: best_available'),
        ({'durability': 'transient_local'}, 'durability: transient_local'),
        ({'durability': 'system_default'}, 'durability: system_default'),
        ({'durability': 'best_available'}, 'durability: best_available'),
        ({'deadline': 100.0}, 'deadline'),
        ({'deadline': 'infinite', 'lifespan': 'infinite'}, ''),
        ({'lifespan': 100.0}, 'lifespan'),
        ({'liveliness': 'automatic', 'liveliness_lease_duration': 0.1}, ''),
        ({'liveliness': 'manual_by_topic'}, 'liveliness: manual_by_topic'),
        ({'liveliness': 'best_available'}, 'liveliness: best_available'),
    ],
)
def test_what_only_the_middleware_keeps_is_sent(policies, expected):
    assert why_sent(create_qos_profile(QosSpec('default', policies, ()), {})) == expected


SILENT = """
version: 1
defaults: {local_delivery: %s}
nodes:
  talker:
    publishers:
      late: {type: std_msgs/msg/Int32, qos: {deadline: 0.1}}
      mute: {type: std_msgs/msg/Int32, qos: &mute {liveliness: manual_by_topic, liveliness_lease_duration: 0.1}}
    timers:
      once: {period: 0.01, behaviour: 'parts:speak_once'}
  listener:
    subscriptions:
      late: {type: std_msgs/msg/Int32, qos: {deadline: 0.2}, behaviour: 'parts:hear'}
      mute: {type: std_msgs/msg/Int32, qos: *mute, behaviour: 'parts:hear'}
"""
SPEAK = """
def speak_once(node):
    if not hasattr(node.state, 'spoke'):
        node.state.spoke = True
        for name in ('late', 'mute'):
            node.publish(name, {'data': 1})

def hear(node, message):
    node.logger.info('heard')
"""
EVENTS = [
    'published nothing within its deadline',
    'got no message within its deadline',
    'lost its liveliness',
    'lost a publisher',
]


@pytest.mark.parametrize('is_local', ['true', 'false'])
def test_events_of_qos_occur_either_way(compose, is_local):
    system = compose(SILENT % is_local, SPEAK)
    for event in EVENTS:
        system.wait_for_line(event)
    assert len(system.matching('heard')) == 2


if __name__ == '__main__':
    first, count = map(int, sys.argv[1:])
    peer = Outsider(int(os.environ['ROS_DOMAIN_ID']))
    with tempfile.TemporaryDirectory() as place:
        for number in range(first, first + count):
            try:
                print(number, compare(create_scenario(number), Path(place), peer), flush=True)
            except AssertionError as error:
                print(number, 'FAILED', error, flush=True)
    peer.close()


@pytest.mark.parametrize(
    ('environment', 'expected'),
    [
        ({}, False),
        (dict.fromkeys(PROFILE_VARIABLES, PROFILE), False),
        ({'FASTRTPS_DEFAULT_PROFILES_FILE': 'my.xml'}, True),
        ({'FASTDDS_DEFAULT_PROFILES_FILE': 'my.xml'}, True),
        ({'RMW_FASTRTPS_PUBLICATION_MODE': 'ASYNCHRONOUS'}, True),
    ],
)
def test_a_message_may_be_late_with_profiles_of_users_alone(environment, expected):
    assert may_be_late('rmw_fastrtps_cpp', environment) is expected
