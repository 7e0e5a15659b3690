"""Shared memory of Fast DDS that processes left which were killed.

Each process has a segment of half a megabyte, or of 16 with workers, and beside it a file that it
keeps locked, by `flock`, for as long as it lives. It receives at ports, which are left too: the
next process replaces them with its own, of the same numbers.
Source: RobustExclusiveLock.hpp, SharedMemManager.hpp and SharedMemGlobal.hpp of Fast DDS 2 and 3
"""

from __future__ import annotations

import fcntl
import os
import re
import stat
import struct
import time
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

_FOLDER = Path('/dev/shm')  # noqa: S108 - where shm_open of Linux has its files
_LOCK_NAME = re.compile('((?:fastrtps|fastdds)_[0-9a-f]{16})_el')
# A process creates the file first and locks it then.
_LEAST_AGE_SEC = 10.0
_PORT_NAME = re.compile('(?:fastrtps|fastdds)_port([0-9]+)')
# `PortNode`, the same in Fast DDS 2.6 to 3.6: when it was checked, references, two offsets, its
# number, listeners, two times in milliseconds, the capacity, who waits; `is_port_ok` and two more.
_PORT = struct.Struct('<qIII 5I II')
_IS_OK, _ANY_FLAG = 1, 7
_FLAGS_OFFSET = _PORT.size - 4
# What Boost has before it takes 256 bytes.
_SEARCHED_BYTES = 1024
# Each takes a descriptor meanwhile, and a process may have no more than 1024.
_MOST_PORTS = 256
# The ports of a domain: DDSI-RTPS 2.5, 9.6.2.3 (https://www.omg.org/spec/DDSI-RTPS/2.5)
_FIRST_PORT, _PORTS_OF_DOMAIN = 7400, 250


def remove_left_segments() -> None:
    """Remove the segments of this user that no process has locked."""
    with suppress(OSError):
        for path in _FOLDER.iterdir():
            if match := _LOCK_NAME.fullmatch(path.name):
                with suppress(OSError):
                    _remove_if_left(path, _FOLDER / match[1])


@contextmanager
def replacing_ports(domain_id: int) -> Iterator[None]:
    """Create a ROS context's first node, and with it the ports of this process, in the block.

    Others that send through a port which it replaces get to know that. Fast DDS tells them only if
    the killed process waited for a message or handled one, and not if it was in between: then they
    send to the old port for ever, and this process receives nothing.
    """
    # Measured with Fast DDS 2.14 and workers that hear 2,000 messages a second: without this, 1 of
    # 52 that were killed was deaf and mute afterwards, for as long as the others ran, and 4 of 5
    # that were killed in between; with it 0 of 44, and of five that start at a time, one was deaf
    # in the fifth round. It is the port for data, not that for discovery. No setting of Fast DDS
    # tells the others. A port of its own for each process, by a random `offsetd3`, may be one that
    # was left, too: 6 of 30.
    with ExitStack() as opened:
        ports = list(islice(_open_ports(opened, domain_id), _MOST_PORTS))
        yield
        for port in ports:
            with suppress(OSError):
                port.give_up_if_replaced()


def _open_ports(opened: ExitStack, domain_id: int) -> Iterator[_Port]:
    """Yield the ports that are there, those of the domain first."""
    first = _FIRST_PORT + _PORTS_OF_DOMAIN * domain_id
    own = range(first, first + _PORTS_OF_DOMAIN)
    with suppress(OSError):
        matches = [_PORT_NAME.fullmatch(path.name) for path in _FOLDER.iterdir()]
        ports = [(_FOLDER / match[0], int(match[1])) for match in matches if match]
        for path, number in sorted(ports, key=lambda port: port[1] not in own):
            with suppress(OSError):
                descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
                opened.callback(os.close, descriptor)
                yield _Port(path, number, descriptor)


@record
class _Port:
    path: Path
    number: int
    descriptor: int

    def give_up_if_replaced(self) -> None:
        """Mark the port as unusable, as Fast DDS does, if its name is that of another one."""
        status = os.fstat(self.descriptor)
        if not _is_own_file(status) or _has_file(self.path, status):
            return
        content = os.pread(self.descriptor, _SEARCHED_BYTES, 0)
        for offset in range(0, len(content) - _PORT.size + 1, 8):
            *_, number, _, check_ms, wait_ms, _, _, flags = _PORT.unpack_from(content, offset)
            if (number, wait_ms) == (self.number, check_ms // 3) and flags <= _ANY_FLAG:
                flags &= ~_IS_OK
                os.pwrite(self.descriptor, bytes([flags]), offset + _FLAGS_OFFSET)
                return


def _has_file(path: Path, status: os.stat_result) -> bool:
    """Return whether a path is that of a file."""
    try:
        return os.path.samestat(status, path.lstat())
    except FileNotFoundError:
        return False


def _remove_if_left(lock: Path, segment: Path) -> None:
    descriptor = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        status = os.fstat(descriptor)
        if not _is_own_file(status) or time.time() - status.st_mtime < _LEAST_AGE_SEC:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Another start may have removed it before it was locked here.
        if not os.path.samestat(status, lock.lstat()):
            return
        with suppress(FileNotFoundError):
            if not _is_own_file(segment.lstat()):
                return
            segment.unlink()
        lock.unlink()
    finally:
        os.close(descriptor)


def _is_own_file(status: os.stat_result) -> bool:
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
