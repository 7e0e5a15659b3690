"""What makes a run not repeatable: it is reported, with the line that does it.

Python's audit events tell of sockets, processes and threads; clocks that count work, not time, are
read as they are. Source: https://docs.python.org/3/library/audit_events.html
"""

from __future__ import annotations

import ast
import os
import socket
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from composer.records import record
from composer.virtual_time.preemption import is_own_code
from composer.virtual_time.replaced_functions import ReplacedFunction

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

    from composer.virtual_time.simulated_threads import SimulatedThreads

_PACKAGE = str(Path(__file__).resolve().parents[1])
THREAD: Final = 'starts a thread of its own, whose turns come only where others wait'
_PROCESS = 'starts a process, which takes real time'
_SOCKET = 'uses a socket: what others send comes in real time'
_C_FUNCTION: Final = 'ctypes.dlsym'
_C_CLOCKS: Final = (
    *('clock_gettime', 'gettimeofday', 'time', 'ftime', 'timespec_get', 'clock'),
    *('nanosleep', 'clock_nanosleep', 'usleep', 'sleep'),
)
_C_CLOCK: Final = 'reads a clock in C, or sleeps there: that is real time'
# What numpy takes for the time of its own clock.
_NOW: Final = ('now', 'today')
_EVENTS: Final = {
    _C_FUNCTION: _C_CLOCK,
    'socket.connect': _SOCKET,
    'socket.bind': _SOCKET,
    'socket.sendto': _SOCKET,
    'socket.getaddrinfo': _SOCKET,
    'subprocess.Popen': _PROCESS,
    'os.system': _PROCESS,
    'os.fork': _PROCESS,
    'os.forkpty': _PROCESS,
    'os.posix_spawn': _PROCESS,
    'os.exec': _PROCESS,
}
_COUNTERS: Final = (
    (time, 'process_time'),
    (time, 'process_time_ns'),
    (time, 'thread_time'),
    (time, 'thread_time_ns'),
    (os, 'times'),
)


@record
class Notice:
    """Something that may be otherwise in another run.

    Attributes:
        what: What a behaviour does, as in `starts a process, which takes real time`.
        file: The file that does it.
    """

    what: str
    file: str
    line: int

    def __str__(self) -> str:
        """Return `file:line what`."""
        return f'{self.file}:{self.line} {self.what}'


class Watch:
    """Notes what simulated threads do that is not simulated."""

    def __init__(self, threads: SimulatedThreads) -> None:
        self.notices: dict[Notice, None] = {}
        self._threads = threads

    def on_audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Take an audit event of any thread."""
        what = _EVENTS.get(event)
        if what is None or self._threads.mine() is None:
            return
        if event == _C_FUNCTION and arguments[1] not in _C_CLOCKS:
            return
        if what is _SOCKET and getattr(arguments[0], 'family', None) == socket.AF_UNIX:
            return
        self.note(what)

    def note(self, what: str) -> None:
        """Note what a behaviour does; what this package or rclpy does is its own business."""
        frame = _user_frame()
        if frame is not None:
            self.notices[Notice(what, frame.f_code.co_filename, frame.f_lineno)] = None

    def note_numpy_clocks(self, path: Path) -> None:
        """Note where a module of a project asks numpy for the time, which reads it in C."""
        source = path.read_bytes() if path.suffix == '.py' else b''
        if b'datetime64' not in source:
            return
        for each in ast.walk(ast.parse(source)):
            if isinstance(each, ast.Call) and ast.unparse(each.func).endswith('datetime64'):
                first = each.args[0] if each.args else None
                if isinstance(first, ast.Constant) and first.value in _NOW:
                    self.notices[Notice(_C_CLOCK, str(path), each.lineno)] = None

    def counters(self) -> Iterator[tuple[ReplacedFunction, Callable[..., Any]]]:
        """Yield clocks that count work, and what notes that they are read."""
        for module, name in _COUNTERS:
            yield self._counter(ReplacedFunction(getattr(module, name)), name)

    def _counter(
        self, target: ReplacedFunction, name: str
    ) -> tuple[ReplacedFunction, Callable[..., Any]]:
        def read() -> Any:
            if self._threads.mine() is not None:
                self.note(f'reads {name}(), which counts real work')
            return target.original()

        return target, read


def _user_frame() -> FrameType | None:
    """Return the innermost call that is in no library; `None` if a library made it by itself."""
    frame: FrameType | None = sys._getframe(1)  # noqa: SLF001 - the only way
    while frame is not None:
        path = frame.f_code.co_filename
        if path.startswith(_PACKAGE) or f'{os.sep}rclpy{os.sep}' in path:
            if not path.startswith(f'{_PACKAGE}{os.sep}virtual_time'):
                return None
        elif is_own_code(path):
            return frame
        frame = frame.f_back
    return None


_watches: list[Watch] = []
_is_hooked = False


def _tell_watches(event: str, arguments: tuple[Any, ...]) -> None:
    for watch in _watches:
        watch.on_audit(event, arguments)


def begin(watch: Watch) -> Callable[[], None]:
    """Let a watch note what happens from now on; return what ends that."""
    global _is_hooked  # noqa: PLW0603 - an audit hook cannot be removed
    _watches.append(watch)
    if not _is_hooked:
        _is_hooked = True
        sys.addaudithook(_tell_watches)
    return lambda: _watches.remove(watch)
