"""Events between the middleware and the executor; no wake-up of the leader gets lost."""

import resource

import pytest

pytest.importorskip('rclpy')

from composer.executor import event_poller
from composer.executor.c_bindings import write_eventfd
from composer.executor.event_poller import EventPoller

pytestmark = pytest.mark.ros

A_THREAD_THAT_WAITS = -1


@pytest.fixture
def poller():
    poller = EventPoller()
    yield poller
    poller.close()


class Listener:
    def __init__(self, rank, heard):
        self.rank = rank
        self.heard = heard

    def on_events(self, count):
        self.heard.append(self.rank)


def test_an_event_of_a_listener_that_has_just_gone_is_skipped(poller):
    heard = []
    listener = Listener(0, heard)
    event_fd = poller.attach(listener)
    write_eventfd(event_fd.fd)
    arrived = poller._wait(5.0)
    assert arrived
    poller.detach(listener, event_fd)
    poller._dispatch(arrived)
    assert heard == []


def test_of_several_events_the_least_rank_comes_first(poller):
    heard = []
    for rank in (3, 1, 2, 0):
        write_eventfd(poller.attach(Listener(rank, heard)).fd)
    assert poller.peek()
    assert heard == [0, 1, 2, 3]


def test_the_last_descriptors_of_the_process_are_left_to_others(poller, monkeypatch):
    monkeypatch.setattr(event_poller, '_spare_event_fds', event_poller._SpareEventFds())
    monkeypatch.setattr(resource, 'setrlimit', lambda _what, _limits: None)
    first = poller.attach(Listener(0, []))
    soft = first.fd + 20
    monkeypatch.setattr(resource, 'getrlimit', lambda _what: (soft, soft))
    assert poller.attach(Listener(0, [])) is first
    monkeypatch.setattr(resource, 'getrlimit', lambda _what: (soft, 2 * soft))
    assert poller.attach(Listener(0, [])) is not first


def test_a_thread_that_only_peeks_leaves_a_wake_up_to_those_that_wait(poller):
    poller._waiting_threads.add(A_THREAD_THAT_WAITS)
    poller.wake()
    assert poller.peek()
    assert poller._wait(0), 'the leader would sleep on'


def test_a_thread_that_peeks_while_none_waits_uses_up_the_wake_up(poller):
    poller._waiting_threads.add(A_THREAD_THAT_WAITS)
    poller.wake()
    poller._waiting_threads.clear()
    assert poller.peek()
    assert not poller._wait(0), 'the leader would never sleep'
