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


def by_publisher(texts):
    found = defaultdict(list)
    for text in texts:
        publisher, number = text.split(':')
        found[publisher].append(int(number))
    return dict(found)


def check_stay(heard, told):
    """Check what a visitor got: the middleware and the publishers count alike."""
    offsets, last = {}, {}
    for text, number in heard:
        publisher, published = text.split(':')
        published = int(published)
        assert offsets.setdefault(publisher, published - number) == published - number, told
        assert published > last.get(publisher, 0), told
        last[publisher] = published


@pytest.fixture
def outsider(domain_id):
    outsider = Outsider(domain_id)
    yield outsider
    outsider.close()


def test_both_ways_deliver_and_drop_the_same(tmp_path, outsider):
    handed_over = sum(
        compare(create_scenario(seed), tmp_path, outsider) for seed in range(1, 21)
    )
    assert handed_over > 500


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
