"""A channel is of use as long as there is somebody at its other end, and then keeps nothing."""

import os
import socket

import pytest

from composer.processes.channel import Channel, ChannelLostError


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
