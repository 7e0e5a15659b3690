"""A subscription that is recreated hears each message once: a message is sent at every moment."""

import json
import sys
import threading
from collections import Counter
from unittest import mock

import pytest

pytest.importorskip('rclpy')

from composer.errors import StartError
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.fresh_start import running_system

pytestmark = pytest.mark.ros

ROOMS = ('/runtime/rewiring/', '/runtime/entities/', '/runtime/messages/')
MANY = 4000
# Of the moments in a loop.
AT_MOST = 2
DEEP = {'reliability': 'reliable', 'depth': MANY}
EDITS = {
    'deeper': {'qos': {**DEEP, 'depth': MANY + 1}},
    'best effort': {'qos': {**DEEP, 'reliability': 'best_effort'}},
    'always sent': {'qos': {**DEEP, 'lifespan': 100.0}},
    'group': {'group': 'own'},
    'reentrant': {'group': 'reentrant'},
    'options': {'with': {'word': 'other'}},
    'two at once': {'qos': {**DEEP, 'depth': MANY + 1}, 'group': 'own', 'read_only': True},
}
_long = pytest.mark.long
WAYS = (
    'handed over',
    'sent first',
    pytest.param('sent', marks=_long),
    pytest.param('heard outside', marks=_long),
)
# Each edit; each way with three of them, and with both states of the subscription.
HAND_OVERS = [
    ('deeper', 'handed over', 'in a callback'),
    pytest.param('deeper', 'sent first', 'free', marks=_long),
    pytest.param('best effort', 'handed over', 'free', marks=_long),
    ('best effort', 'sent', 'in a callback'),
    ('always sent', 'heard outside', 'free'),
    pytest.param('always sent', 'handed over', 'in a callback', marks=_long),
    ('group', 'sent first', 'in a callback'),
    pytest.param('reentrant', 'sent', 'free', marks=_long),
    ('reentrant', 'heard outside', 'in a callback'),
    pytest.param('options', 'heard outside', 'free', marks=_long),
    pytest.param('two at once', 'sent', 'free', marks=_long),
    ('two at once', 'sent first', 'in a callback'),
]


class Ear:
    """Keeps what the behaviour hears; it can be held in a message."""

    def __init__(self):
        self.heard = []
        self.goes_on = threading.Event()
        self.goes_on.set()

    def __call__(self, message):
        self.heard.append(message.data)
        assert self.goes_on.wait(DEADLINE_SEC)


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
        self.sent = 0
        self._path = path
        self._way = way
        self._moments = Counter()
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
        publisher['local_delivery'] = self._way != 'sent'
        nodes = {
            'talker': {'publishers': {'out': publisher}},
            'ear': {'subscriptions': {'numbers': self.subscription | changes}},
        }
        self._path.write_text(json.dumps({'version': 1, 'nodes': nodes}))

    def run(self, system):
        nodes = {each.ros.get_name(): each for each in system._nodes.values()}
        self._out = nodes['talker'].behaviour_node
        self._listener = None
        if self._way in {'heard outside', 'sent first'}:
            self._listener = self._come(nodes['talker'].ros)
        for _ in range(3):
            self.publish()

    @staticmethod
    def _come(ros):
        from std_msgs.msg import Int64

        listener = ros.create_subscription(Int64, '/t', lambda message: None, MANY)
        return lambda: ros.destroy_subscription(listener)

    def publish(self):
        self._out.publish('out', {'data': self.sent})
        self.sent += 1
        if self._way == 'sent first' and self.sent > 20 and self._listener:
            self._listener()
            self._listener = None

    def at_each_moment(self, frame, event, argument):
        """Publish at each call and each return in the hand-over; a profile function.

        Not within a queue: there another thread would wait.
        """
        moment = frame.f_code.co_filename, frame.f_lineno, event
        self._moments[moment] += 1
        if any(room in moment[0] for room in ROOMS) and self._moments[moment] <= AT_MOST:
            self.publish()


@pytest.fixture
def ear():
    ear = Ear()
    _ears.append(ear)
    yield ear
    ear.goes_on.set()
    _ears.remove(ear)


def reload_under_fire(bed, system, reloader):
    sys.setprofile(bed.at_each_moment)
    try:
        return reloader.reload(system)
    finally:
        sys.setprofile(None)


@pytest.mark.parametrize(('edit', 'way', 'state'), HAND_OVERS)
def test_each_message_is_heard_once_and_in_order(edit, way, state, ear, domain_id, tmp_path):
    bed = Bed(tmp_path / 'system.yaml', way)
    with running_system([tmp_path / 'system.yaml'], checks=False) as (system, reloader):
        if state == 'in a callback':
            ear.goes_on.clear()
        bed.run(system)
        wait_for(lambda: ear.heard, 'the first message')
        bed.write(**EDITS[edit])
        assert reload_under_fire(bed, system, reloader).succeeded
        assert bed.sent > 20
        ear.goes_on.set()
        bed.publish()
        wait_for(lambda: len(ear.heard) >= bed.sent, f'{bed.sent} messages: {ear.heard}')
        found = sorted(ear.heard) if edit == 'reentrant' else ear.heard
        assert found == list(range(bed.sent))


@pytest.mark.parametrize('way', WAYS)
def test_each_message_is_heard_once_if_the_edit_is_undone(way, ear, domain_id, tmp_path):
    bed = Bed(tmp_path / 'system.yaml', way)
    error = StartError('no')
    with running_system([tmp_path / 'system.yaml'], checks=False) as (system, reloader):
        bed.run(system)
        bed.write(**EDITS['two at once'])
        with mock.patch('composer.runtime.rewiring.rewire.set_sim_times', side_effect=error):
            assert not reload_under_fire(bed, system, reloader).succeeded
        assert bed.sent > 20
        bed.publish()
        wait_for(lambda: len(ear.heard) >= bed.sent, f'{bed.sent} messages: {ear.heard}')
        assert ear.heard == list(range(bed.sent))


@pytest.mark.parametrize('way', WAYS)
def test_a_shorter_queue_keeps_the_newest(way, ear, domain_id, tmp_path):
    bed = Bed(tmp_path / 'system.yaml', way)
    with running_system([tmp_path / 'system.yaml'], checks=False) as (system, reloader):
        ear.goes_on.clear()
        bed.run(system)
        wait_for(lambda: ear.heard, 'the first message')
        bed.write(qos={**DEEP, 'depth': 3})
        assert reload_under_fire(bed, system, reloader).succeeded
        ear.goes_on.set()
        wait_for(lambda: bed.sent - 1 in ear.heard, f'the last of {bed.sent}: {ear.heard}')
        assert ear.heard == sorted(set(ear.heard))
        assert ear.heard[-3:] == list(range(bed.sent - 3, bed.sent))
        # What was handed over may wait beside what was sent.
        assert len(ear.heard) <= 1 + 2 * 3
