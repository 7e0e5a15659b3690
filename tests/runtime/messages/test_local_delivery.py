"""Whether messages are handed over or sent, the same come, in the same order, and are dropped.

`python -m tests.runtime.messages.test_local_delivery SEED COUNT` plays more scenarios.
"""

import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Int64

from composer.language.specs import QosSpec
from composer.network.transport_profile import PROFILE, PROFILE_VARIABLES
from composer.runtime.messages.delivery_policies import may_be_late, why_sent
from composer.runtime.messages.qos_profiles import create_qos_profile
from tests.running import wait_for
from tests.runtime.messages.player import play
from tests.runtime.messages.scenarios import create_scenario

pytestmark = pytest.mark.ros


def compare(scenario, folder):
    """Play a scenario both ways; return how many messages were handed over."""
    sent = play(scenario, folder, is_local=False)
    local = play(scenario, folder, is_local=True)
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
    return local.handed_over


def by_publisher(texts):
    found = defaultdict(list)
    for text in texts:
        publisher, number = text.split(':')
        found[publisher].append(int(number))
    return dict(found)


@pytest.mark.parametrize(
    'seeds', [range(1, 4), pytest.param(range(4, 12), marks=pytest.mark.long)], ids=str
)
def test_both_ways_deliver_and_drop_the_same(tmp_path, domain_id, seeds):
    handed_over = sum(compare(create_scenario(seed), tmp_path) for seed in seeds)
    assert handed_over > 12 * len(seeds)


@pytest.mark.parametrize(
    ('policies', 'expected'),
    [
        ({}, ''),
        ({'history': 'keep_all'}, ''),
        ({'reliability': 'best_effort'}, ''),
        ({'reliability': 'system_default'}, 'reliability: system_default'),
        ({'reliability': 'best_available'}, 'reliability: best_available'),
        ({'durability': 'transient_local'}, 'durability: transient_local'),
        ({'deadline': 100.0}, 'deadline'),
        ({'deadline': 'infinite', 'lifespan': 'infinite'}, ''),
        ({'lifespan': 100.0}, 'lifespan'),
        ({'liveliness': 'automatic', 'liveliness_lease_duration': 0.1}, ''),
        ({'liveliness': 'manual_by_topic'}, 'liveliness: manual_by_topic'),
    ],
)
def test_what_only_the_middleware_keeps_is_sent(policies, expected):
    assert why_sent(create_qos_profile(QosSpec('default', policies, ()), {})) == expected


COUNTING = """
version: 1
nodes:
  talker:
    state: {count: 0}
    publishers: {numbers: {type: std_msgs/msg/Int64, qos: 1000, local_delivery: true}}
    timers: {count: {period: 0.005, behaviour: 'parts:count', publish: numbers}}
  ear:
    state: {heard: 0}
    subscriptions: {numbers: {type: std_msgs/msg/Int64, qos: 1000, behaviour: 'parts:hear'}}
"""
COUNT = """
def count(node):
    node.state.count += 1
    return node.state.count

def hear(node, message):
    if message.data != node.state.heard + 1:
        node.logger.error(f'{message.data} came after {node.state.heard}')
    node.state.heard = message.data
"""


def test_who_comes_and_goes_outside_hears_all_and_disturbs_nobody(compose, peer):
    child = compose(COUNTING, COUNT)
    child.wait_until_ready()
    for _ in range(3):
        heard = peer.listen(Int64, '/numbers', 1000)
        wait_for(lambda heard=heard: len(heard) > 50, 'numbers')
        (end,) = [each for each in peer.node.subscriptions if each.topic_name == '/numbers']
        peer.run(peer.node.destroy_subscription, end)
        numbers = [message.data for message in heard]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert child.stop() == 0
    assert not child.matching('[ERROR]'), child.output


@pytest.mark.parametrize(
    ('environment', 'expected'),
    [
        ({}, False),
        (dict.fromkeys(PROFILE_VARIABLES, PROFILE), False),
        ({'FASTRTPS_DEFAULT_PROFILES_FILE': 'my.xml'}, True),
        ({'RMW_FASTRTPS_PUBLICATION_MODE': 'ASYNCHRONOUS'}, True),
    ],
)
def test_a_message_may_be_late_with_profiles_of_users_alone(environment, expected):
    assert may_be_late('rmw_fastrtps_cpp', environment) is expected


if __name__ == '__main__':
    first, count = map(int, sys.argv[1:])
    with tempfile.TemporaryDirectory() as place:
        for number in range(first, first + count):
            try:
                print(number, compare(create_scenario(number), Path(place)), flush=True)
            except AssertionError as error:
                print(number, 'FAILED', error, flush=True)
