"""A worker that was killed hears the others again, whatever its threads were at."""

import os
import re
import signal
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from tests.running import wait_for
from tests.runtime.workers.observed import CODE, HEARS, TALKS, node, pid_of, system

pytestmark = pytest.mark.ros

NODES = {'talker': node('left', *TALKS), 'far': node('right', *HEARS)}
# A port has the state of each of its listeners, of 20 bytes, and then the prefix of its name.
LISTENERS, LISTENER_BYTES = 1024, 20
IS_IN_USE = 1
LOCK_NAME = '(/dev/shm/(fastrtps|fastdds)_port[0-9]+)_el'


def ports_of(pid):
    """Return the files of the ports of shared memory that a process receives at."""
    for link in Path(f'/proc/{pid}/fd').iterdir():
        with suppress(OSError):
            if found := re.fullmatch(LOCK_NAME, str(link.readlink())):
                yield Path(found[1]), found[2].encode()


def kill_between_messages(pid):
    """Kill a process as if none of its listeners waited for a message or handled one just then."""
    os.kill(pid, signal.SIGSTOP)
    stat = Path(f'/proc/{pid}/stat')
    wait_for(lambda: stat.read_text().rpartition(')')[2].split()[0] == 'T', 'the process to stop')
    ports = list(ports_of(pid))
    assert ports
    for port, prefix in ports:
        with port.open('r+b') as file:
            first = file.read().index(prefix + b'\0') - LISTENERS * LISTENER_BYTES
            file.seek(first)
            file.write(bytes([IS_IN_USE]))
    os.kill(pid, signal.SIGKILL)


def test_a_worker_hears_again_that_was_killed_between_two_messages(compose):
    child = compose(system(NODES, 'workers: {right: {restart: {delay: 0.1}}}\n'), CODE)
    child.wait_until_ready()
    first = pid_of(child, 'far')
    child.wait_for_line(f' in {first}')
    child.wait_for_line('far hears')
    kill_between_messages(first)
    again = pid_of(child, 'far', times=2)
    wait_for(lambda: re.search(f'far hears .* in {again}', child.output), 'messages')
    assert child.stop() == 0
