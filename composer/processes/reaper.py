"""The parent of all external processes of a system: a small process of its own.

It runs as a script and imports nothing of Composer, to start fast and stay small. It starts,
signals and waits for processes as Composer asks over a socket. When the socket closes or Composer
dies, however that happens, it kills every process that descends from those it started:

- It is the subreaper of its descendants: children whose parent has ended become its own, whatever
  sessions they have made.
- The kernel kills each process that it started if the reaper itself dies (`PR_SET_PDEATHSIG`
  counts the death of the parent's thread; the reaper has only one).
- A second reaper is its parent, and a subreaper, too: when the first one is killed, its remaining
  descendants become children of the second one, which kills them. It also ends the first one if
  that hangs after Composer has gone.
- Every process that it starts has a mark in its environment, for Composer to find if both reapers
  are killed.

Requests and answers are one JSON object a line. Requests: `start` (a number that Composer chooses,
`command`, `env`, `cwd`, and a descriptor for the output), and `stop` (the number, `signal`,
`timeout`). Answers, each with the number: `started` or `failed` (`errno`, `doing`), `ended`
(`code`, negative for a signal), and `gone`, once nothing of its process group is left. Before it
comes `urged` (`signal`) if half the timeout of a stop has passed, and SIGTERM follows the signal
that was asked for, and `killed` if all of it has. A second descriptor is for what a process writes
to standard error, if that goes elsewhere, and a third one becomes its descriptor `LINK`.
Source: https://man7.org/linux/man-pages/man2/prctl.2.html
"""

import contextlib
import ctypes
import fcntl
import json
import os
import resource
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
# See the guardian, which need not kill what the reaper has started.
_RLIMIT_LOCKS = 10
# See the guardian.
_STACKS_SIGNAL = signal.SIGRTMAX
_KILL_SEC = 5.0
_POLL_SEC = 0.02
# No other signal follows these but SIGKILL.
_LAST_SIGNALS = (signal.SIGTERM, signal.SIGKILL)
_CHUNK = 1 << 16
_NEVER = float('inf')
_EXEC_FAILED = 127
# How many descriptors a request may come with.
_MOST_DESCRIPTORS = 16
# The descriptor of a process for the connection to Composer.
LINK = 3
# Programs start with the default actions, whatever Composer and Python ignore or handle.
_DEFAULT_SIGNALS = signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}

_prctl = ctypes.CDLL(None).prctl


class _ProcessGroup:
    """A process that was started, with the group that it leads."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.has_ended = False
        self.is_killed = False
        self.urge_at = self.kill_at = _NEVER
        self.urge = (signal.SIGTERM, False)

    def signal(self, number: int, *, alone: bool = False) -> bool:
        """Signal the group, or its leader alone; return whether any process is left in it."""
        try:
            # Until it is waited for, its ID is that of no other process.
            kill = os.kill if alone and not self.has_ended else os.killpg
            kill(self.pid, number)
        except ProcessLookupError:
            return False
        except PermissionError:
            pass  # it runs as another user by now
        return True


class Reaper:
    """Starts and stops processes as Composer asks, until the connection ends.

    Args:
        composer: The process ID of Composer.
    """

    def __init__(self, connection: socket.socket, composer: int) -> None:
        self._connection = connection
        self._composer = composer
        self._groups: dict[int, _ProcessGroup] = {}
        self._received = b''
        self._descriptors: list[int] = []

    def run(self) -> None:
        """Serve until Composer or the connection ends."""
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
            stopping = any(each.kill_at < _NEVER for each in self._groups.values())
            ready = {each for each, _ in poll.poll(_POLL_SEC * 1000 if stopping else None)}
            if ended in ready:
                return
            if wake_up in ready:
                os.read(wake_up, _CHUNK)
            self._reap()
            self._check_groups()
            if self._connection.fileno() in ready and not self._receive():
                return

    def _receive(self) -> bool:
        """Serve the requests that have come; return whether Composer is still connected."""
        try:
            data, descriptors, _, _ = socket.recv_fds(self._connection, _CHUNK, _MOST_DESCRIPTORS)
        except ConnectionError:
            return False
        for descriptor in descriptors:
            os.set_inheritable(descriptor, False)
        self._descriptors += descriptors
        *lines, self._received = (self._received + data).split(b'\n')
        for line in lines:
            request = json.loads(line)
            if request['do'] == 'start':
                count = request['descriptors']
                self._start(request, self._descriptors[:count])
                del self._descriptors[:count]
            else:
                self._stop(request)
        return bool(data)

    def _answer(self, kind: str, number: int, **details: Any) -> None:
        line = json.dumps({'kind': kind, 'number': number, **details}).encode() + b'\n'
        # If Composer has gone, `run` notices.
        with contextlib.suppress(OSError):
            self._connection.sendall(line)

    def _start(self, request: dict[str, Any], descriptors: list[int]) -> None:
        report, report_end = os.pipe2(os.O_CLOEXEC)
        reaper = os.getpid()
        pid = os.fork()
        if pid == 0:
            _execute(request, descriptors, report_end, reaper)
        for each in (*descriptors, report_end):
            os.close(each)
        with os.fdopen(report, 'rb') as reader:
            failure = reader.read()
        if failure:
            os.waitpid(pid, 0)
            self._answer('failed', request['number'], **json.loads(failure))
            return
        self._groups[request['number']] = _ProcessGroup(pid)
        self._answer('started', request['number'], pid=pid)

    def _stop(self, request: dict[str, Any]) -> None:
        group = self._groups.get(request['number'])
        if group is None:
            self._answer('gone', request['number'])
            return
        now, timeout_sec = time.monotonic(), request['timeout']
        group.kill_at = now + timeout_sec
        if request['signal'] not in _LAST_SIGNALS:
            group.urge_at = now + timeout_sec / 2
        # `ros2 launch` leaves on SIGTERM what it has started, and sends that SIGTERM by itself. It
        # heeds no second SIGINT, unless Python lost the first one while it started.
        if request['alone']:
            group.urge = (request['signal'], True)
        group.signal(request['signal'], alone=request['alone'])
        # A stopped process handles the signal when it continues.
        group.signal(signal.SIGCONT)
        self._check_groups()

    def _reap(self) -> None:
        """Collect all children that have ended."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if pid == 0:
                return
            for number, group in list(self._groups.items()):
                if group.pid == pid and not group.has_ended:
                    group.has_ended = True
                    code = os.waitstatus_to_exitcode(status)
                    self._answer('ended', number, code=code)

    def _check_groups(self) -> None:
        """Report the groups that are gone, and kill those that have run out of time."""
        now = time.monotonic()
        for number, group in list(self._groups.items()):
            # The kernel does not reuse the ID of a group while a process is in it.
            if group.has_ended and not group.signal(0):
                del self._groups[number]
                self._answer('gone', number)
            elif now >= group.kill_at:
                if not group.is_killed:
                    self._answer('killed', number)
                group.is_killed = True
                group.signal(signal.SIGKILL)
            elif now >= group.urge_at:
                group.urge_at = _NEVER
                urge, alone = group.urge
                self._answer('urged', number, signal=urge)
                group.signal(urge, alone=alone)
                group.signal(signal.SIGCONT)


def _execute(request: dict[str, Any], descriptors: list[int], report: int, reaper: int) -> None:
    """Replace a forked child by the requested program; does not return."""
    doing = 'prepare'
    try:
        os.setsid()
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != reaper:
            os._exit(_EXEC_FAILED)
        signal.set_wakeup_fd(-1)
        for each in _DEFAULT_SIGNALS:
            with contextlib.suppress(OSError, ValueError):
                signal.signal(each, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
        output, *others = descriptors
        os.dup2(output, 1)
        os.dup2(others[0] if others else output, 2)
        for link in others[1:]:
            # The number may be that of the report, which is needed until the end.
            report = fcntl.fcntl(report, fcntl.F_DUPFD_CLOEXEC, LINK + 1)
            os.dup2(link, LINK)
            # Composer may ask for the stacks before Python can print them.
            signal.signal(_STACKS_SIGNAL, signal.SIG_IGN)
        doing = 'folder'
        if request['cwd'] is not None:
            os.chdir(request['cwd'])
        doing = 'program'
        os.execvpe(request['command'][0], request['command'], request['env'])  # noqa: S606 - no shell on purpose
    except BaseException as error:  # noqa: BLE001 - the child must not go on as a reaper
        number = error.errno if isinstance(error, OSError) else 0
        os.write(report, json.dumps({'doing': doing, 'errno': number}).encode())
    os._exit(_EXEC_FAILED)


def find_marked(mark: str) -> set[int]:
    """Return the other processes that have this mark in their environment."""
    wanted = f'{mark}=1'.encode()
    found = set()
    for pid in _all_processes():
        # It may have ended, or belong to another user.
        with contextlib.suppress(OSError):
            if wanted in Path(f'/proc/{pid}/environ').read_bytes().split(b'\0'):
                found.add(pid)
    return found - {os.getpid()}


def find_descendants(ancestor: int) -> set[int]:
    """Return all living descendants of a process."""
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
    """Kill all processes with this mark, until none is left."""
    _kill_all(lambda: find_marked(mark))


def _kill_all(find: Callable[[], set[int]]) -> None:
    deadline = time.monotonic() + _KILL_SEC
    while time.monotonic() < deadline:
        found = find()
        if not found:
            return
        for pid in found:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(_POLL_SEC / 4)


def _remove(folder: str) -> None:
    """Remove a folder of files, unless Composer has done so."""
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            os.unlink(entry)  # noqa: PTH108 - fast
        os.rmdir(folder)  # noqa: PTH106 - fast


def _clean_up(mark: str, folder: str) -> None:
    """Kill all descendants, and remove the temporary files."""
    myself = os.getpid()
    _kill_all(lambda: find_descendants(myself) | find_marked(mark))
    _remove(folder)


def _supervise(reaper: int, composer: int) -> None:
    """As the second reaper, wait until the first one has ended, or end it."""
    ended = select.poll()
    ended.register(os.pidfd_open(reaper), select.POLLIN)
    with contextlib.suppress(ProcessLookupError):
        either = select.poll()
        for pid in (reaper, composer):
            either.register(os.pidfd_open(pid), select.POLLIN)
        either.poll()
    # The first one gives up killing after `_KILL_SEC`.
    if not ended.poll(2 * _KILL_SEC * 1000):
        os.kill(reaper, signal.SIGKILL)
    os.waitpid(reaper, 0)


def main() -> None:
    """Serve; the arguments: connection, ID of Composer, mark, and folder to remove at the end."""
    descriptor, composer, mark, folder = int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:5]
    # Composer decides when to end; a signal to its whole process group comes here, too.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    # Ignored, it would have the kernel reap what is waited for here.
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    _, hard = resource.getrlimit(_RLIMIT_LOCKS)
    resource.setrlimit(_RLIMIT_LOCKS, (hard, hard))
    os.set_inheritable(descriptor, False)
    reaper = os.fork()
    try:
        if reaper == 0:
            os.setsid()
            _prctl(_PR_SET_CHILD_SUBREAPER, 1)
            Reaper(socket.socket(fileno=descriptor), composer).run()
        else:
            os.close(descriptor)
            _supervise(reaper, composer)
    finally:
        _clean_up(mark, folder)


if __name__ == '__main__':
    main()
