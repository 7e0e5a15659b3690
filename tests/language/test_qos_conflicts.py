"""What never matches, against what rclpy says and against publishers that do or do not connect."""

import random
from itertools import product

import pytest

from composer.language.parsing.system_parser import parse_system
from composer.language.qos import BEST_OF_PUBLISHERS, resolve_qos, settle_best_available
from composer.language.qos_conflicts import find_qos_conflicts

CHOICES = {
    'reliability': ['system_default', 'reliable', 'best_effort', 'best_available'],
    'durability': ['system_default', 'volatile', 'transient_local', 'best_available'],
    'liveliness': ['system_default', 'automatic', 'manual_by_topic', 'best_available'],
    'deadline': [None, 'infinite', 1, 2],
    'liveliness_lease_duration': [None, 'infinite', 1, 2],
}
PLAIN = {'reliability': 'reliable', 'durability': 'volatile', 'liveliness': 'automatic'}


def spec_of(policies):
    """Return the QoS that a file with these policies declares."""
    written = {key: value for key, value in policies.items() if value is not None}
    node = {'publishers': {'a': {'type': 'std_msgs/msg/String', 'qos': written}}}
    return parse_system({'version': 1, 'nodes': {'n': node}}, '').nodes['n'].publishers['a'].qos


def never_match(offered, requested):
    pair = (resolve_qos(spec_of(each), {}) for each in (offered, requested))
    return [conflict.policy for conflict in find_qos_conflicts(*pair)]


def differing_in_one_policy():
    for policy, values in CHOICES.items():
        for offered, requested in product(values, values):
            yield PLAIN | {policy: offered}, PLAIN | {policy: requested}


def anything(seed, count):
    choose = random.Random(seed)
    for _ in range(count):
        yield tuple(
            {policy: choose.choice(values) for policy, values in CHOICES.items()} for _ in range(2)
        )


@pytest.mark.parametrize(
    ('policy', 'offered', 'requested', 'shown'),
    [
        (
            'reliability',
            'best_effort',
            'reliable',
            'reliability: best_effort is offered, reliable is requested',
        ),
        ('deadline', 2, 0.5, 'deadline: 2 s is offered, 0.5 s is requested'),
        ('deadline', None, 1, 'deadline: infinite is offered, 1 s is requested'),
        # Less than a nanosecond is none to the middleware.
        ('deadline', 1e-10, 1, 'deadline: infinite is offered, 1 s is requested'),
    ],
)
def test_a_conflict_names_what_is_offered_and_requested(policy, offered, requested, shown):
    pair = (resolve_qos(spec_of(PLAIN | {policy: each}), {}) for each in (offered, requested))
    assert list(map(str, find_qos_conflicts(*pair))) == [shown]


@pytest.mark.ros
def test_rclpy_says_the_same_but_for_what_the_module_names():
    from rclpy.qos import QoSCompatibility, qos_check_compatible

    from composer.runtime.messages.qos_profiles import create_qos_profile

    def as_rclpy_sees_it(policies, is_publisher):
        seen = {key: value for key, value in policies.items() if value != 'infinite'}
        if is_publisher and seen['liveliness'] == 'system_default':
            seen['liveliness'] = 'automatic'
        return create_qos_profile(spec_of(seen), {})

    verdicts = set()
    for offered, requested in [*differing_in_one_policy(), *anything(7, 1000)]:
        verdict, reason = qos_check_compatible(
            as_rclpy_sees_it(offered, is_publisher=True),
            as_rclpy_sees_it(requested, is_publisher=False),
        )
        found = never_match(offered, requested)
        assert bool(found) == (verdict == QoSCompatibility.ERROR), (offered, requested, reason)
        assert len(found) == reason.count('ERROR'), (offered, requested, reason)
        verdicts.add(verdict)
    assert len(verdicts) == 3


@pytest.mark.ros
def test_publishers_and_subscriptions_connect_if_and_only_if_nothing_is_said(context, wait_for):
    import rclpy
    from std_msgs.msg import String

    from composer.runtime.messages.qos_profiles import create_qos_profile

    def stay_apart(offered, requested):
        return never_match(settle_best_available(offered, BEST_OF_PUBLISHERS), requested)

    pairs = [*differing_in_one_policy(), *anything(8, 100)]
    nodes = [rclpy.create_node(name, context=context) for name in ('talker', 'listener')]
    joined, apart = [], []
    # Those that are said to stay apart come first: when the last of the others has connected,
    # they have had their time.
    for offered, requested in sorted(pairs, key=lambda pair: not stay_apart(*pair)):
        topic = f'topic_{len(joined) + len(apart)}'
        publisher = nodes[0].create_publisher(
            String, topic, create_qos_profile(spec_of(offered), {})
        )
        nodes[1].create_subscription(
            String, topic, print, create_qos_profile(spec_of(requested), {})
        )
        (apart if stay_apart(offered, requested) else joined).append(
            (publisher, offered, requested)
        )
    assert len(joined) > 20
    assert len(apart) > 20
    for publisher, offered, requested in joined:
        wait_for(publisher.get_subscription_count, f'{offered} to meet {requested}')
    for publisher, offered, requested in apart:
        assert publisher.get_subscription_count() == 0, (offered, requested)
    for node in nodes:
        node.destroy_node()
