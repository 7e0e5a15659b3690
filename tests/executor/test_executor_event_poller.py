"""Events between the middleware and the executor; no wake-up of the leader gets lost."""

import pytest

pytest.importorskip('rclpy')

from composer.executor.event_poller import EventPoller

pytestmark = pytest.mark.ros

A_THREAD_THAT_WAITS = -1


@pytest.fixture
def poller():
    poller = EventPoller()
    yield poller
    poller.close()


def test_a_thread_that_only_peeks_leaves_a_wake_up_to_those_that_wait(poller):
    poller.waiting_threads.add(A_THREAD_THAT_WAITS)
    poller.wake()
    assert poller.peek()
    assert poller._epoll.poll(0), 'the leader would sleep on'


def test_a_thread_that_peeks_while_none_waits_uses_up_the_wake_up(poller):
    poller.waiting_threads.add(A_THREAD_THAT_WAITS)
    poller.wake()
    poller.waiting_threads.clear()
    assert poller.peek()
    assert not poller._epoll.poll(0), 'the leader would never sleep'
