"""Samples which thread of another process holds the interpreter (the GIL): a process of its own.

Whoever asks within a process waits for the interpreter himself, and when he has it, nobody else
does. So another process reads the holder out of the memory, and disturbs nobody.

It runs as a script and imports nothing of Composer, to start fast and stay small. It begins when
it is sent a byte, and ends when it is killed, when the process has ended, and when it may not
read. What it finds is in a table of 64-bit numbers that both share, see below.
"""

import contextlib
import ctypes
import mmap
import os
import resource
import struct
import sys
import time

# The numbers of the table: how long it has sampled, how long somebody held the interpreter in
# that time, both in nanoseconds, how many samples there were, and how many threads follow. Each
# thread has two: its identifier, and how long it held the interpreter.
ELAPSED, HELD, SAMPLES, THREADS, FIRST = range(5)
MOST_THREADS = 1022
TABLE_SIZE = 8 * (FIRST + 2 * MOST_THREADS)
# `last_holder` and `locked` of `struct _gil_runtime_state`.
HOLDER = struct.Struct('=Qi')

RLIMIT_LOCKS = 10
# A sample costs up to 0.1 ms of a processor. Pauses differ, so they keep no step with timers.
_SHORTEST_SEC, _LONGEST_SEC = 0.006, 0.018
# Where processors are scarce, a sample is late, and comes when a thread has just let go of one,
# and so mostly of the interpreter, too: it says nothing about the time before.
_LATE_NS = 1_000_000
_NS_PER_SEC = 1e9
_GOLDEN = 0.6180339887498949


class Memory:
    """Reads a place in the memory of a process.

    Args:
        size: How many bytes.
    """

    def __init__(self, pid: int, size: int) -> None:
        self._pid = pid
        self._buffer = ctypes.create_string_buffer(size)
        self._size = size
        # A thread that reads its own process holds the interpreter meanwhile.
        self._read = ctypes.PyDLL(None, use_errno=True).process_vm_readv
        self._into = self._vector(ctypes.addressof(self._buffer))

    def _vector(self, address: int) -> 'ctypes.Array[ctypes.c_size_t]':
        """Return a `struct iovec`."""
        return (ctypes.c_size_t * 2)(address, self._size)

    def read(self, address: int) -> bytes:
        """Return what is there, up to what cannot be read."""
        there = self._vector(address)
        one, none = ctypes.c_ulong(1), ctypes.c_ulong(0)
        count = self._read(self._pid, self._into, one, there, one, none)
        return self._buffer.raw[: max(0, count)]


def main(pid: int, descriptor: int, holder_address: int, thread_offset: int) -> None:
    """Sample until the process has ended.

    Args:
        pid: The process.
        descriptor: Of the table.
        holder_address: Where `HOLDER` is in its memory.
        thread_offset: Where the identifier of the thread is in a `PyThreadState`.
    """
    table = memoryview(mmap.mmap(descriptor, TABLE_SIZE)).cast('Q')
    holder, thread = Memory(pid, HOLDER.size), Memory(pid, 8)
    # Another one may have begun it.
    known = range(FIRST, FIRST + 2 * table[THREADS], 2)
    places = {table[place]: place + 1 for place in known}
    phase, before_ns, due_ns = 0.0, time.monotonic_ns(), 0
    while data := holder.read(holder_address):
        now_ns = time.monotonic_ns()
        passed_ns, before_ns = now_ns - before_ns, now_ns
        if now_ns > due_ns + _LATE_NS:
            passed_ns = 0
        state, is_locked = HOLDER.unpack(data)
        if is_locked and passed_ns:
            table[HELD] += passed_ns
            # The thread may have ended meanwhile.
            if ident := int.from_bytes(thread.read(state + thread_offset), sys.byteorder):
                place = places.get(ident) or add_thread(table, places, ident)
                table[place] += passed_ns
        table[ELAPSED] += passed_ns
        table[SAMPLES] += 1
        phase = (phase + _GOLDEN) % 1.0
        pause_sec = _SHORTEST_SEC + phase * (_LONGEST_SEC - _SHORTEST_SEC)
        due_ns = now_ns + int(pause_sec * _NS_PER_SEC)
        time.sleep(pause_sec)


def leave_to_itself() -> None:
    """Take off the mark of what behaviours have started (`composer.processes.guardian`)."""
    with contextlib.suppress(OSError, ValueError):
        _, hard = resource.getrlimit(RLIMIT_LOCKS)
        resource.setrlimit(RLIMIT_LOCKS, (hard, hard))


def add_thread(table: 'memoryview[int]', places: dict[int, int], ident: int) -> int:
    """Return where the time of a thread is, which is new; the last place is for all too many."""
    number = min(table[THREADS], MOST_THREADS - 1)
    place = FIRST + 2 * number
    table[place], table[THREADS] = ident, number + 1
    places[ident] = place + 1
    return place + 1


if __name__ == '__main__':
    leave_to_itself()
    os.read(0, 1)
    main(*map(int, sys.argv[1:]))
