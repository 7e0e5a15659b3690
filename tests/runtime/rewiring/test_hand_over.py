"""A subscription that is recreated hears each message once: a message is sent at every moment."""

import json
import sys
import threading
from functools import cache
from unittest import mock

import pytest

pytest.importorskip('rclpy')

from composer.errors import StartError
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.fresh_start import running_system

pytestmark = pytest.mark.ros

ROOMS = ('/runtime/rewiring/', '/runtime/entities/', '/runtime/messages/')
MANY = 4000
DEEP = {'reliability': 'reliable', 'depth': MANY}
EDITS = {
    'deeper': {'qos': {**DEEP, 'depth': MANY + 1}},
    'best effort': {'qos': {**DEEP, 'reliability': 'best_effort'}},
    'group': {'group': 'own'},
    'options': {'with': {'word': 'other'}},
    'two at once': {'qos': {**DEEP, 'depth': MANY + 1}, 'group': 'own', 'read_only': True},
}
# Each way has its edits, which are made in turn: in a callback of the subscription, and beside.
WAYS = {
    'handed over': ('deeper', 'options', 'best effort'),
    'sent first': ('two at once', 'group'),
}


@cache
def is_in_rooms(filename):
    return any(room in filename for room in ROOMS)


class Ear:
    """Keeps what the behaviour hears; it can be held in a message."""

    def __init__(self):
        self.heard = []
        self.is_held = False
        self.goes_on = threading.Event()
        self.goes_on.set()

    def __call__(self, message):
        self.heard.append(message.data)
        self.is_held = not self.goes_on.is_set()
        assert self.goes_on.wait(DEADLINE_SEC)
        self.is_held = False


_ears = []


def hear(node, message, word):
    """Take a message; the behaviour of the subscription."""
    _ears[-1](message)


class Bed:
    """A system whose subscription is edited.

    Attributes:
        sent: How many messages were published.
    """

    def __init__(self, path, way):
        self.sent = self._first = 0
        self._path = path
        self._way = way
        self._moments = set()
        self.subscription = {
            'topic': '/t',
            'type': 'std_msgs/msg/Int64',
            'behaviour': f'{__name__}:hear',
            'with': {'word': 'one'},
            'qos': DEEP,
        }
        self.write()

    def write(self, **changes):
        publisher = {'topic': '/t', 'type': 'std_msgs/msg/Int64', 'qos': DEEP}
        nodes = {
            'talker': {'publishers': {'out': publisher}},
            'ear': {'subscriptions': {'numbers': self.subscription | changes}},
        }
        self._path.write_text(json.dumps({'version': 1, 'nodes': nodes}))

    def run(self, system):
        nodes = {each.ros.get_name(): each for each in system._nodes.values()}
        self._out = nodes['talker'].behaviour_node
        self._talker = nodes['talker'].ros
        self._listener = None
        for _ in range(3):
            self.publish()

    def begin_round(self):
        """Let somebody listen outside, if the way is like that."""
        from std_msgs.msg import Int64

        self._moments.clear()
        self._first = self.sent
        if self._listener is None and self._way == 'sent first':
            self._listener = self._talker.create_subscription(Int64, '/t', lambda _: None, MANY)

    def publish(self):
        self._out.publish('out', {'data': self.sent})
        self.sent += 1
        if self._way == 'sent first' and self.sent > self._first + 20 and self._listener:
            self._talker.destroy_subscription(self._listener)
            self._listener = None

    def at_each_moment(self, frame, event, argument):
        """Publish at each call and each return in the hand-over, once; a profile function.

        Not within a queue: there another thread would wait.
        """
        if is_in_rooms(frame.f_code.co_filename):
            moment = frame.f_code, frame.f_lineno, event
            if moment not in self._moments:
                self._moments.add(moment)
                self.publish()


@pytest.fixture
def ear():
    ear = Ear()
    _ears.append(ear)
    yield ear
    ear.goes_on.set()
    _ears.remove(ear)


def reload_under_fire(bed, system, reloader):
    bed.begin_round()
    before = bed.sent
    sys.setprofile(bed.at_each_moment)
    try:
        outcome = reloader.reload(system)
    finally:
        sys.setprofile(None)
    assert bed.sent > before + 20
    return outcome.succeeded


@pytest.mark.parametrize('way', WAYS)
def test_each_message_is_heard_once_and_in_order(way, ear, domain_id, tmp_path):
    bed = Bed(tmp_path / 'system.yaml', way)

    def hold():
        ear.goes_on.clear()
        bed.publish()
        wait_for(lambda: ear.is_held, 'a message')

    def check_all_heard(edit):
        ear.goes_on.set()
        bed.publish()
        wait_for(lambda: len(ear.heard) >= bed.sent, f'{bed.sent} messages: {ear.heard}')
        assert ear.heard == list(range(bed.sent)), edit

    with running_system([tmp_path / 'system.yaml'], checks=False) as (system, reloader):
        bed.run(system)
        for number, edit in enumerate(WAYS[way]):
            if number % 2 == 0:
                hold()
            bed.write(**EDITS[edit])
            assert reload_under_fire(bed, system, reloader)
            check_all_heard(edit)

        # An edit that is undone.
        bed.write()
        error = StartError('no')
        with mock.patch('composer.runtime.rewiring.rewire.set_sim_times', side_effect=error):
            assert not reload_under_fire(bed, system, reloader)
        check_all_heard('undone')

        # A shorter queue keeps the newest.
        hold()
        before = bed.sent
        bed.write(qos={**DEEP, 'depth': 3})
        assert reload_under_fire(bed, system, reloader)
        ear.goes_on.set()
        wait_for(lambda: bed.sent - 1 in ear.heard, f'the last of {bed.sent}: {ear.heard}')
        assert ear.heard == sorted(set(ear.heard))
        assert ear.heard[-3:] == list(range(bed.sent - 3, bed.sent))
        # What was handed over may wait beside what was sent.
        assert len(ear.heard) <= before + 2 * 3
