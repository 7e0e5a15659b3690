"""A channel is of use as long as there is somebody at its other end, and then keeps nothing."""

import os
import socket
import threading

import pytest

from composer.errors import ComposerError
from composer.processes.channel import Channel, ChannelLostError
from tests.running import DEADLINE_SEC


def test_a_channel_lets_go_of_its_socket_when_the_other_end_has_gone(wait_for):
    own, other = socket.socketpair()
    channel = Channel(own.detach(), 'the other one', {})
    descriptor = channel._socket.fileno()
    channel.listen()
    assert channel.is_intact
    other.close()
    wait_for(lambda: not channel.is_intact, 'the end of the channel')
    with pytest.raises(OSError, match='Bad file descriptor'):
        os.fstat(descriptor)
    with pytest.raises(ChannelLostError, match='the other one has gone'):
        channel.call('ping')


def test_a_call_that_no_thread_can_serve_is_answered(monkeypatch):
    """As where the process may start no more threads; else the caller waits for ever."""
    ends = [each.detach() for each in socket.socketpair()]
    caller, server = (Channel(end, 'the other one', {'ping': lambda: 'pong'}) for end in ends)
    start, full = threading.Thread.start, "can't start new thread"

    def start_unless_full(thread):
        if thread.name == 'ping' and is_full:
            raise RuntimeError(full)
        start(thread)

    monkeypatch.setattr(threading.Thread, 'start', start_unless_full)
    caller.listen()
    server.listen()
    is_full = True
    with pytest.raises(ComposerError, match=f'ping: {full}'):
        caller.call('ping', timeout_sec=DEADLINE_SEC)
    is_full = False
    assert caller.call('ping', timeout_sec=DEADLINE_SEC) == 'pong'
    os.write(caller._socket.fileno(), b'no pickle')
