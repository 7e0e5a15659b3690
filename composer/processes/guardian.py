"""The parent of all foreign processes of a system: a small process of its own.

It is run as a script and imports nothing of Composer: it has to start fast and to stay small. It
starts, signals and awaits processes as it is asked to over a socket. When the socket closes or
Composer dies, however that was, it kills all that has ever come out of what it started:

- It is the subreaper of its descendants, so the children of a process that has ended become its
  own, whatever sessions they have made.
- The kernel kills each process that it started if the guardian itself dies (`PR_SET_PDEATHSIG`;
  the guardian has one thread, and so is no prey of the rule that the thread counts).
- A second guardian is its parent, and a subreaper, too: when the first one is killed, what is left
  of its descendants becomes the second one's own, which kills it. It also ends the first one if
  that does not do its work when Composer has gone.
- All that was started has a mark in its environment, for Composer to find if both are killed.

Requests and answers are one JSON object a line. Requests: `start` (a number of Composer's
choice, `command`, `env`, `cwd`, and a descriptor for the output), and `stop` (the number,
`signal`, `timeout`). Answers, each with the number: `started` or `failed` (`errno`, `doing`),
`ended` (`code`, negative for a signal), and `gone`, once nothing of its process group is left;
`killed` comes before it if the timeout of a stop has passed.
Source: https://man7.org/linux/man-pages/man2/prctl.2.html
"""

import contextlib
import ctypes
import json
import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_PATIENCE_SEC = 5.0
_POLL_SEC = 0.02
_CHUNK = 1 << 16
_NEVER = float('inf')
_EXEC_FAILED = 127
# What Composer and Python ignore or handle is nothing to programs that are started.
_DEFAULT_SIGNALS = signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}

_prctl = ctypes.CDLL(None).prctl


class _Guarded:
    """A process, and how it is being stopped."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.has_ended = False
        self.is_killed = False
        self.kill_at = _NEVER

    def signal(self, number: int) -> bool:
        """Signal its process group; return whether there is still somebody in it."""
        try:
            os.killpg(self.pid, number)
        except ProcessLookupError:
            return False
        except PermissionError:
            pass  # somebody is there, who has become another user
        return True


class Guardian:
    """Does what Composer asks for, until the connection to it ends.

    Args:
        composer: The process to watch.
    """

    def __init__(self, connection: socket.socket, composer: int) -> None:
        self._connection = connection
        self._composer = composer
        self._guarded: dict[int, _Guarded] = {}
        self._received = b''
        self._descriptors: list[int] = []

    def run(self) -> None:
        """Serve until the end of Composer, or of the connection."""
        try:
            ended = os.pidfd_open(self._composer)
        except ProcessLookupError:
            return
        wake_up, wake_up_end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
        signal.set_wakeup_fd(wake_up_end, warn_on_full_buffer=False)
        poll = select.poll()
        for descriptor in (ended, wake_up, self._connection.fileno()):
            poll.register(descriptor, select.POLLIN)
        while True:
            stopping = any(each.kill_at < _NEVER for each in self._guarded.values())
            ready = {each for each, _ in poll.poll(_POLL_SEC * 1000 if stopping else None)}
            if ended in ready:
                return
            if wake_up in ready:
                os.read(wake_up, _CHUNK)
            self._reap()
            self._look_after_all()
            if self._connection.fileno() in ready and not self._receive():
                return

    def _receive(self) -> bool:
        """Serve what was asked for; return whether Composer is still connected."""
        try:
            data, descriptors, _, _ = socket.recv_fds(self._connection, _CHUNK, 16)
        except ConnectionError:
            return False
        for descriptor in descriptors:
            os.set_inheritable(descriptor, False)
        self._descriptors += descriptors
        *lines, self._received = (self._received + data).split(b'\n')
        for line in lines:
            request = json.loads(line)
            if request['do'] == 'start':
                self._start(request, self._descriptors.pop(0))
            else:
                self._stop(request)
        return bool(data)

    def _answer(self, kind: str, number: int, **details: Any) -> None:
        line = json.dumps({'kind': kind, 'number': number, **details}).encode() + b'\n'
        # Composer may have gone, which shows elsewhere.
        with contextlib.suppress(OSError):
            self._connection.sendall(line)

    def _start(self, request: dict[str, Any], output: int) -> None:
        report, report_end = os.pipe2(os.O_CLOEXEC)
        guardian = os.getpid()
        pid = os.fork()
        if pid == 0:
            _become(request, output, report_end, guardian)
        os.close(output)
        os.close(report_end)
        with os.fdopen(report, 'rb') as told:
            failure = told.read()
        if failure:
            os.waitpid(pid, 0)
            self._answer('failed', request['number'], **json.loads(failure))
            return
        self._guarded[request['number']] = _Guarded(pid)
        self._answer('started', request['number'], pid=pid)

    def _stop(self, request: dict[str, Any]) -> None:
        process = self._guarded.get(request['number'])
        if process is None:
            self._answer('gone', request['number'])
            return
        process.kill_at = time.monotonic() + request['timeout']
        process.signal(request['signal'])
        # One that is stopped hears it when it goes on.
        process.signal(signal.SIGCONT)
        self._look_after_all()

    def _reap(self) -> None:
        """Take note of all children that have ended."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if pid == 0:
                return
            for number, process in list(self._guarded.items()):
                if process.pid == pid and not process.has_ended:
                    process.has_ended = True
                    code = os.waitstatus_to_exitcode(status)
                    self._answer('ended', number, code=code)

    def _look_after_all(self) -> None:
        """Say who is gone, and kill who should be by now."""
        for number, process in list(self._guarded.items()):
            # The number of a group is not given away while somebody is in it.
            if process.has_ended and not process.signal(0):
                del self._guarded[number]
                self._answer('gone', number)
            elif time.monotonic() >= process.kill_at:
                if not process.is_killed:
                    self._answer('killed', number)
                process.is_killed = True
                process.signal(signal.SIGKILL)


def _become(request: dict[str, Any], output: int, report: int, guardian: int) -> None:
    """Turn a forked child into the program that was asked for; does not return."""
    doing = 'prepare'
    try:
        os.setsid()
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != guardian:
            os._exit(_EXEC_FAILED)
        signal.set_wakeup_fd(-1)
        for each in _DEFAULT_SIGNALS:
            with contextlib.suppress(OSError, ValueError):
                signal.signal(each, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
        os.dup2(output, 1)
        os.dup2(output, 2)
        doing = 'folder'
        if request['cwd'] is not None:
            os.chdir(request['cwd'])
        doing = 'program'
        os.execvpe(request['command'][0], request['command'], request['env'])  # noqa: S606 - no shell on purpose
    except BaseException as error:  # noqa: BLE001 - nothing of the guardian may go on here
        number = error.errno if isinstance(error, OSError) else 0
        os.write(report, json.dumps({'doing': doing, 'errno': number}).encode())
    os._exit(_EXEC_FAILED)


def find_marked(mark: str) -> set[int]:
    """Return the processes that have a variable in their environment, apart from this one."""
    wanted = f'{mark}=1'.encode()
    found = set()
    for pid in _all_processes():
        # It may have ended, or belong to somebody else.
        with contextlib.suppress(OSError):
            if wanted in Path(f'/proc/{pid}/environ').read_bytes().split(b'\0'):
                found.add(pid)
    return found - {os.getpid()}


def find_descendants(ancestor: int) -> set[int]:
    """Return all children of a process, theirs, and so on, that have not ended."""
    children: dict[int, list[int]] = {}
    for pid in _all_processes():
        with contextlib.suppress(OSError):
            status = Path(f'/proc/{pid}/stat').read_bytes().rpartition(b')')[2].split()
            if status[0] not in (b'Z', b'X'):
                children.setdefault(int(status[1]), []).append(pid)
    found: set[int] = set()
    pending = [ancestor]
    while pending:
        below = children.get(pending.pop(), [])
        pending += below
        found.update(below)
    return found


def _all_processes() -> list[int]:
    return [int(name) for name in os.listdir('/proc') if name.isdecimal()]  # noqa: PTH208 - fast


def kill_marked(mark: str) -> None:
    """Kill all processes with a mark, until there are none."""
    _kill_all(lambda: find_marked(mark))


def _kill_all(find: Callable[[], set[int]]) -> None:
    deadline = time.monotonic() + _PATIENCE_SEC
    while time.monotonic() < deadline:
        found = find()
        if not found:
            return
        for pid in found:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(_POLL_SEC / 4)


def _remove(folder: str) -> None:
    """Remove a folder of files; Composer may have done so itself."""
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            os.unlink(entry)  # noqa: PTH108 - fast
        os.rmdir(folder)  # noqa: PTH106 - fast


def _clean_up(mark: str, folder: str) -> None:
    """Kill all descendants, and remove what is temporary."""
    myself = os.getpid()
    _kill_all(lambda: find_descendants(myself) | find_marked(mark))
    _remove(folder)


def _watch(guardian: int, composer: int) -> None:
    """Be the second guardian: wait for the end of the first one, and see to it."""
    ended = select.poll()
    ended.register(os.pidfd_open(guardian), select.POLLIN)
    with contextlib.suppress(ProcessLookupError):
        either = select.poll()
        for pid in (guardian, composer):
            either.register(os.pidfd_open(pid), select.POLLIN)
        either.poll()
    # What the first one has to do then takes it no longer than its patience.
    if not ended.poll(2 * _PATIENCE_SEC * 1000):
        os.kill(guardian, signal.SIGKILL)
    os.waitpid(guardian, 0)


def main() -> None:
    """Guard; the arguments: connection, process to watch, mark, and folder to remove at last."""
    descriptor, composer, mark, folder = int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:5]
    # Composer decides when it is over; what goes to a whole group of processes comes here too.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    os.set_inheritable(descriptor, False)
    guardian = os.fork()
    try:
        if guardian == 0:
            os.setsid()
            _prctl(_PR_SET_CHILD_SUBREAPER, 1)
            Guardian(socket.socket(fileno=descriptor), composer).run()
        else:
            os.close(descriptor)
            _watch(guardian, composer)
    finally:
        _clean_up(mark, folder)


if __name__ == '__main__':
    main()
