"""Few descriptors for any number of entities; the busy ones have their own."""

import errno
import os
import resource
import weakref
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')

from rclpy.exceptions import InvalidHandle
from spinning import DEADLINE_SEC, spinning, wait_for
from std_msgs.msg import Empty

from composer.executor import event_fds
from composer.executor.descriptors import write_eventfd
from composer.executor.event_poller import EventPoller

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


class Listener:
    """An entity without a middleware; `is_used` is whether someone uses it after its end."""

    event_fd = None

    def __init__(self, heard: list[str], name: str = '', rank: int = 0) -> None:
        self.heard = heard
        self.name = name
        self.rank = rank
        self.has_own_event_fd = not name.startswith('seldom')
        self.fd: int | None = None
        self.is_destroyed = self.is_used = False

    def watch(self, fd: int | None) -> None:
        if self.is_destroyed:
            raise InvalidHandle
        self.fd = fd

    def is_gone(self) -> bool:
        return self.is_destroyed and not self.is_used

    def on_events(self, count: int) -> None:
        self.heard.append(self.name)

    def write(self) -> None:
        write_eventfd(self.fd)


@pytest.fixture
def poller(monkeypatch):
    monkeypatch.setattr(event_fds, '_own_event_fds', event_fds._OwnEventFds())
    monkeypatch.setattr(event_fds, '_MOVE_INTERVAL_SEC', 0.0)
    poller = EventPoller()
    yield poller
    poller.close()


def attach(poller, heard, *names):
    listeners = [Listener(heard, name) for name in names]
    for listener in listeners:
        poller.event_fds.attach(listener)
    return listeners


def heard_of(poller, heard):
    heard.clear()
    poller.peek()
    return sorted(heard)


def is_open(fd):
    return Path(f'/proc/self/fd/{fd}').exists()


def test_what_is_seldom_busy_shares_until_it_is_busy(poller):
    heard: list[str] = []
    first, second, often = attach(poller, heard, 'seldom first', 'seldom second', 'often')
    assert first.fd == second.fd != often.fd
    first.write()
    assert heard_of(poller, heard) == ['seldom first', 'seldom second']
    often.write()
    assert heard_of(poller, heard) == ['often']
    poller.event_fds.note_busy(first)
    first.write()
    assert heard_of(poller, heard) == ['seldom first']
    second.write()
    assert heard_of(poller, heard) == ['seldom second']


def test_what_shares_an_eventfd_is_forgotten_when_it_is_gone(poller):
    heard: list[str] = []
    staying, *leaving = attach(poller, heard, *(f'seldom {number}' for number in range(9)))
    kept: list[weakref.ref[Listener]] = []
    for each in leaving:
        each.is_destroyed = True
        poller.event_fds.detach(each)
        kept.append(weakref.ref(each))
    del leaving, each
    # The last one goes when the next one does.
    assert sum(reference() is not None for reference in kept) <= 1
    staying.write()
    assert heard_of(poller, heard) == ['seldom 0']


def test_the_silent_make_room_for_the_busy(poller, monkeypatch):
    monkeypatch.setattr(event_fds, '_MAX_OWN_SHARE', 3 / 1024)
    heard: list[str] = []
    names = ['a', 'b', 'c', 'd', 'e']
    by_name = dict(zip(names, attach(poller, heard, *names), strict=True))
    assert by_name['d'].fd == by_name['e'].fd
    heard_of(poller, heard)
    for _ in range(3):
        for name in ('a', 'c', 'e'):
            by_name[name].write()
        assert {'a', 'c', 'e'} <= set(heard_of(poller, heard))
        poller.event_fds.note_busy(by_name['e'])
    for name in ('a', 'c', 'e'):
        by_name[name].write()
    assert heard_of(poller, heard) == ['a', 'c', 'e']
    by_name['b'].write()
    assert heard_of(poller, heard) == ['b', 'd']


def test_an_event_during_a_move_is_not_lost(poller):
    heard: list[str] = []
    first, second = attach(poller, heard, 'seldom first', 'seldom second')
    first.write()
    poller.event_fds.note_busy(first)
    assert heard == ['seldom first']
    assert heard_of(poller, heard) == ['seldom second']
    poller.event_fds.detach(second)
    assert len(poller.event_fds.by_number) == 1


def test_a_descriptor_stays_open_while_the_middleware_may_write_to_it(poller):
    (listener,) = attach(poller, [], 'a')
    fd = listener.fd
    listener.is_destroyed = listener.is_used = True
    poller.event_fds.detach(listener)
    (other,) = attach(poller, [], 'b')
    assert other.fd != fd
    assert is_open(fd)
    listener.is_used = False
    poller.event_fds.detach(other)
    assert not is_open(fd)
    assert not is_open(other.fd)


def test_without_descriptors_an_eventfd_is_shared(poller, monkeypatch):
    heard: list[str] = []
    attach(poller, heard, 'first')

    def fail(*_: Any) -> int:
        raise OSError

    monkeypatch.setattr(os, 'eventfd', fail)
    (second,) = attach(poller, heard, 'second')
    second.write()
    assert heard_of(poller, heard) == ['first', 'second']


def test_a_node_that_was_added_without_descriptors_is_served_when_there_are_some(
    node: Any, executor: Any, monkeypatch
) -> None:
    heard: list[Any] = []
    node.create_subscription(Empty, 'topic', heard.append, 1)
    publisher = node.create_publisher(Empty, 'topic', 1)

    def fail(*_: Any) -> int:
        raise OSError(errno.EMFILE, 'no more')

    monkeypatch.setattr(os, 'eventfd', fail)
    for _ in range(2):
        with pytest.raises(OSError, match='no more'):
            executor.spin_once(timeout_sec=DEADLINE_SEC)
    monkeypatch.undo()
    with spinning(executor) as errors:
        publisher.publish(Empty())
        wait_for(lambda: heard)
    assert not errors


def test_of_several_events_the_least_rank_comes_first(poller):
    heard: list[str] = []
    for rank in (3, 1, 2, 0):
        listener = Listener(heard, str(rank), rank)
        poller.event_fds.attach(listener)
        listener.write()
    assert poller.peek()
    assert heard == ['0', '1', '2', '3']


def test_many_entities_leave_descriptors_to_others_and_close_theirs(
    node: Any, executor: Any
) -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    fds = Path('/proc/self/fd')
    before = len(list(fds.iterdir()))
    ticks: set[int] = set()
    timers = [node.create_timer(0.5, lambda i=i: ticks.add(i)) for i in range(1100)]
    got: set[int] = set()
    subscriptions = [
        node.create_subscription(Empty, f'topic_{i}', lambda _, i=i: got.add(i), 1)
        for i in range(40)
    ]
    publishers = [node.create_publisher(Empty, f'topic_{i}', 1) for i in range(40)]
    with spinning(executor):
        wait_for(lambda: len(ticks) == len(timers))
        for publisher in publishers:
            publisher.publish(Empty())
        wait_for(lambda: len(got) == len(subscriptions))
        assert len(list(fds.iterdir())) - before < 40 + 1100 / 32 + 20
        assert resource.getrlimit(resource.RLIMIT_NOFILE) == limits
        for timer in timers:
            node.destroy_timer(timer)
        for subscription in subscriptions:
            node.destroy_subscription(subscription)
        wait_for(lambda: len(list(fds.iterdir())) - before < 20)
