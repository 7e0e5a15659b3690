"""A process of its own that outlives Composer for a moment, to end what Composer started.

It is run as a script, with the process to watch and the mark that all descendants of its children
have in their environment. When that process has died, however it was, everything with the mark is
killed. A line on standard input means that all has been ended already.

It imports nothing of Composer: it has to start fast and to stay small.
"""

import os
import select
import signal
import sys
import time
from pathlib import Path

_PATIENCE_SEC = 5.0
_POLL_SEC = 0.02


def find_marked(mark: bytes) -> list[int]:
    """Return the processes that have a mark in their environment."""
    found = []
    for entry in Path('/proc').iterdir():
        if not entry.name.isdecimal():
            continue
        try:
            variables = (entry / 'environ').read_bytes().split(b'\0')
        except OSError:
            # It has ended, or belongs to somebody else.
            continue
        if mark in variables:
            found.append(int(entry.name))
    return found


def kill_marked(mark: bytes) -> None:
    """Kill all processes that have a mark, until there are none."""
    deadline = time.monotonic() + _PATIENCE_SEC
    while (marked := find_marked(mark)) and time.monotonic() < deadline:
        for process in marked:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue
        time.sleep(_POLL_SEC)


def main() -> None:
    """Wait for the end of a process, or for a line."""
    watched, mark = int(sys.argv[1]), sys.argv[2].encode()
    try:
        ended = os.pidfd_open(watched)
    except ProcessLookupError:
        kill_marked(mark)
        return
    poll = select.poll()
    poll.register(ended, select.POLLIN)
    poll.register(0, select.POLLIN | select.POLLHUP)
    while True:
        ready = dict(poll.poll())
        if ended in ready:
            kill_marked(mark)
            return
        if os.read(0, 1):
            return
        # The other end of the pipe is closed: the process is about to die.
        poll.unregister(0)


if __name__ == '__main__':
    main()
