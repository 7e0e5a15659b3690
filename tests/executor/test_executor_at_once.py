"""A service may be executed by the callback that waits for it, and stays exclusive."""

import random
import threading
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy')

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from std_srvs.srv import Empty

from composer.executor import ComposerExecutor
from tests.running import wait_for

pytestmark = pytest.mark.ros

_CALLERS = 4
_CALLS = 300


class _Request:
    """What is handed to a service."""

    def __init__(self):
        self.message = Empty.Request()
        self.answered = threading.Event()
        self.thread = None

    def respond(self, response):
        assert not self.answered.is_set()
        self.thread = response
        self.answered.set()


class _Callers:
    """A service, and callbacks that hand it requests and wait; a subscription shares its group."""

    def __init__(self, context, group):
        import rclpy

        self.node = rclpy.create_node('node', context=context)
        self.executor = ComposerExecutor(context=context)
        self.executor.add_node(self.node)
        self.group = group
        self.served = self.node.create_service(Empty, 'ask', self._serve, callback_group=group)
        self.inbox = self.executor.open_inbox(self.node, self.served, None)
        self.calls = []
        self.running = self.most = 0

    def _serve(self, _request, _response):
        with self.counted():
            pass
        return threading.get_ident()

    @contextmanager
    def counted(self):
        """Count how many are within at the same time."""
        self.running += 1
        self.most = max(self.most, self.running)
        yield
        self.running -= 1

    def call(self):
        request = _Request()
        if not self.executor.execute_at_once(self.inbox, request):
            self.inbox.put(request)
        with self.executor.waiting():
            assert request.answered.wait(30)
        self.calls.append(request.thread == threading.get_ident())

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def callers(context, request):
    made = _Callers(context, request.param())
    yield made
    made.close()


@pytest.mark.parametrize(
    'callers', [MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup], indirect=True
)
def test_callbacks_that_wait_execute_what_they_wait_for(callers):
    chance = random.Random(1)
    ended = []

    def call_often():
        for _ in range(_CALLS):
            callers.call()
        ended.append(True)

    def share():
        with callers.counted():
            threading.Event().wait(chance.random() * 0.0005)

    timer = callers.node.create_timer(0.001, share, callback_group=callers.group)
    for _ in range(_CALLERS):
        callers.executor.create_task(call_often)
    spinning = threading.Thread(target=callers.executor.spin)
    spinning.start()
    wait_for(lambda: len(ended) == _CALLERS, 'all calls')
    timer.cancel()

    assert len(callers.calls) == _CALLERS * _CALLS
    assert any(callers.calls)
    assert not callers.inbox.messages
    if isinstance(callers.group, MutuallyExclusiveCallbackGroup):
        assert callers.most == 1
    callers.executor.shutdown()
    spinning.join()


@pytest.mark.parametrize('callers', [ReentrantCallbackGroup], indirect=True)
def test_others_wait_for_those_who_spin(callers):
    request = _Request()

    assert not callers.executor.execute_at_once(callers.inbox, request)
    callers.inbox.put(request)
    assert not request.answered.is_set()
    callers.executor.spin_once(5)
    assert request.answered.is_set()
