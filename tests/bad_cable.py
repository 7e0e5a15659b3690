"""A cable between two network namespaces that loses and delays what it carries.

`tc netem` does the same where the kernel has it. This needs nothing but `/dev/net/tun`.
"""

import ctypes
import fcntl
import os
import random
import select
import struct
import sys
import time
from collections import deque
from pathlib import Path

_TUNSETIFF = 0x400454CA
_TAP_WITHOUT_HEADER = 0x1002
_CLONE_NEWNET = 0x40000000
_MOST_BYTES = 65536


def open_end(pid, interface):
    """Return the descriptor of a new interface in the network namespace of a process."""
    libc = ctypes.CDLL(None, use_errno=True)
    with Path(f'/proc/{pid}/ns/net').open() as namespace:
        if libc.setns(namespace.fileno(), _CLONE_NEWNET):
            raise OSError(ctypes.get_errno(), 'setns')
    end = os.open('/dev/net/tun', os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(end, _TUNSETIFF, struct.pack('16sH', interface.encode(), _TAP_WITHOUT_HEADER))
    return end


def carry(ends, loss_percent, delay_sec):
    """Carry frames between the two ends for ever."""
    chance = random.Random(1)
    under_way = deque()
    while True:
        wait_sec = max(under_way[0][0] - time.monotonic(), 0) if under_way else None
        readable, _, _ = select.select(ends, [], [], wait_sec)
        for end in readable:
            frame = os.read(end, _MOST_BYTES)
            if chance.random() * 100 >= loss_percent:
                other = ends[end == ends[0]]
                under_way.append((time.monotonic() + delay_sec, other, frame))
        while under_way and under_way[0][0] <= time.monotonic():
            _, end, frame = under_way.popleft()
            try:
                os.write(end, frame)
            except OSError:
                # The interface is down, or its queue is full: a cable loses such frames, too.
                continue


def main(first_pid, first_name, second_pid, second_name, loss_percent, delay_sec):
    ends = [open_end(first_pid, first_name), open_end(second_pid, second_name)]
    sys.stdout.write('there\n')
    sys.stdout.flush()
    carry(ends, float(loss_percent), float(delay_sec))


if __name__ == '__main__':
    main(*sys.argv[1:])
