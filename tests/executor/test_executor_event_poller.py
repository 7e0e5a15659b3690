"""Signals between the middleware and the executor."""

import resource

import pytest

pytest.importorskip('rclpy')

from composer.executor import event_poller
from composer.executor.c_bindings import write_eventfd
from composer.executor.event_poller import SignalBoard

pytestmark = pytest.mark.ros


class Listener:
    def __init__(self, rank, heard):
        self.rank = rank
        self.heard = heard

    def on_signal(self, count):
        self.heard.append(self.rank)


def test_a_signal_of_what_has_just_gone_is_passed_over():
    board, heard = SignalBoard(), []
    listener = Listener(0, heard)
    signal = board.attach(listener)
    write_eventfd(signal.fd)
    arrived = board.wait(5.0)
    assert arrived
    board.detach(listener, signal)
    board.deliver(arrived)
    assert heard == []
    board.close()


def test_of_several_signals_the_least_rank_is_heard_first():
    board, heard = SignalBoard(), []
    for rank in (3, 1, 2, 0):
        write_eventfd(board.attach(Listener(rank, heard)).fd)
    board.deliver(board.wait(5.0))
    assert heard == [0, 1, 2, 3]
    board.close()


def test_the_last_descriptors_of_the_process_are_left_to_others(monkeypatch):
    board = SignalBoard()
    monkeypatch.setattr(event_poller, '_descriptors', event_poller._Descriptors())
    monkeypatch.setattr(resource, 'setrlimit', lambda _what, _limits: None)
    first = board.attach(Listener(0, []))
    soft = first.fd + 20
    monkeypatch.setattr(resource, 'getrlimit', lambda _what: (soft, soft))
    assert board.attach(Listener(0, [])) is first
    monkeypatch.setattr(resource, 'getrlimit', lambda _what: (soft, 2 * soft))
    assert board.attach(Listener(0, [])) is not first
    board.close()
