"""What makes a run not repeatable: it is reported, with the line that does it.

Python's audit events tell of sockets, processes and threads; clocks that count work, not time, are
read as they are. Source: https://docs.python.org/3/library/audit_events.html
"""

from __future__ import annotations

import _multiprocessing  # type: ignore[import-not-found]
import _signal  # type: ignore[import-not-found]
import _thread
import ast
import builtins
import os
import resource
import socket
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from composer.records import record
from composer.virtual_time.preemption import is_own_code
from composer.virtual_time.replaced_functions import ReplacedFunction, ReplacedMethod

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

    from composer.virtual_time.simulated_threads import SimulatedThreads

_FOLDER, _PACKAGE = (str(each) for each in (*Path(__file__).resolve().parents,)[:2])
THREAD: Final = 'starts a thread of its own, whose turns come only where others wait'
WORK: Final = 'reads {}(), which counts real work'
_PROCESS = 'starts a process, which takes real time'
_SOCKET = 'uses a socket: what others send comes in real time'
_C_FUNCTION: Final = 'ctypes.dlsym'
_C_CLOCKS: Final = (
    *('clock_gettime', 'gettimeofday', 'time', 'ftime', 'timespec_get', 'clock'),
    *('nanosleep', 'clock_nanosleep', 'usleep', 'sleep'),
)
_C_CLOCK: Final = 'reads a clock in C, or sleeps there: that is real time'
_BY_ADDRESS: Final = 'begins coroutines in the order of their addresses'
# What numpy takes for the time of its own clock.
_NOW: Final = ('now', 'today')
_TEMPORARY: Final = 'makes a temporary file or folder, which has another name in each run'
_KERNEL: Final = 'reads a file of the kernel, which is another in each run'
_KERNEL_FOLDERS: Final = ('/proc/', '/sys/', '/dev/random', '/dev/urandom')
_EVENTS: Final = {
    _C_FUNCTION: _C_CLOCK,
    'open': _KERNEL,
    'socket.bind': _SOCKET,
    'socket.connect': _SOCKET,
    'socket.getaddrinfo': _SOCKET,
    'socket.gethostbyname': _SOCKET,
    'socket.sendmsg': _SOCKET,
    'socket.sendto': _SOCKET,
    'subprocess.Popen': _PROCESS,
    'os.system': _PROCESS,
    'os.fork': _PROCESS,
    'os.forkpty': _PROCESS,
    'os.posix_spawn': _PROCESS,
    'os.exec': _PROCESS,
    'socket.gethostname': 'reads the name of this machine',
    'tempfile.mkdtemp': _TEMPORARY,
    'tempfile.mkstemp': _TEMPORARY,
}
_NUMBER: Final = 'reads {}, the number of a process or thread: it is another in each run'
_FILE: Final = 'reads {} of a file, which no virtual time sets'
_SIGNAL: Final = 'calls {}(): signals come in real time'
# Functions, and methods and attributes of types, that tell what is otherwise in another run.
_TELLING: Final[tuple[tuple[Any, tuple[str, ...], str], ...]] = (
    (time, ('process_time', 'process_time_ns', 'thread_time', 'thread_time_ns'), WORK),
    (os, ('times', 'getloadavg'), WORK),
    (resource, ('getrusage',), WORK),
    (os, ('getpid', 'getppid', 'getpgrp', 'getpgid', 'getsid'), _NUMBER),
    (_thread, ('get_ident', 'get_native_id'), _NUMBER),
    (threading.Thread, ('ident', 'native_id'), _NUMBER),
    (builtins, ('id',), 'reads an address, with {}(): it is another in each run'),
    (os.stat_result, ('st_atime', 'st_mtime', 'st_ctime', 'st_ino'), _FILE),
    (os.stat_result, ('st_atime_ns', 'st_mtime_ns', 'st_ctime_ns'), _FILE),
    (_signal, ('sigwait', 'sigwaitinfo', 'sigtimedwait', 'pause', 'alarm', 'setitimer'), _SIGNAL),
    (_multiprocessing.SemLock, ('acquire', '__enter__'), 'waits for a lock of processes'),
)
# Modules of Python whose calls are those of who calls them. Others ask for their own business: a
# log for the number of the process, an import for the age of a file.
_PASSING: Final = frozenset(
    {
        *('genericpath', 'pathlib', 'pathlib._local', 'glob', 'shutil', 'os', 'signal'),
        *('multiprocessing.process', 'multiprocessing.synchronize', 'multiprocessing.queues'),
    }
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
    """Notes what simulated threads do that is not simulated.

    Attributes:
        hears_others: Whether a process has been started, or a socket has been used that leads to
            one: what then comes from files comes in real time.
    """

    def __init__(self, threads: SimulatedThreads) -> None:
        self.notices: dict[Notice, None] = {}
        self.hears_others = False
        self._threads = threads
        self._lines: dict[str, dict[int, str]] = {}
        self._own_sockets: set[object] = set()

    def on_audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Take an audit event of any thread."""
        what = _EVENTS.get(event)
        if what is None or self._threads.mine() is None:
            return
        if event == _C_FUNCTION and arguments[1] not in _C_CLOCKS:
            return
        if what is _KERNEL:
            if str(arguments[0]).startswith(_KERNEL_FOLDERS):
                self.note(what, is_asked=True)
            return
        if what is _SOCKET and self._is_own_socket(event, arguments):
            return
        self.hears_others |= what in (_PROCESS, _SOCKET)
        self.note(what)

    def _is_own_socket(self, event: str, arguments: tuple[Any, ...]) -> bool:
        """Tell whether both ends of a socket are in this process, as nothing else has its name."""
        if getattr(arguments[0], 'family', None) != socket.AF_UNIX:
            return False
        address = arguments[1]
        if event == 'socket.bind':
            self._own_sockets.add(address)
        return address is None or address in self._own_sockets

    def note(self, what: str, *, is_asked: bool = False) -> None:
        """Note what a behaviour does; what this package or rclpy does is its own business.

        Args:
            is_asked: Whether it only counts where a behaviour asks for it itself.
        """
        frame = _asking_frame() if is_asked else _user_frame()
        if frame is not None:
            self.notices[Notice(what, frame.f_code.co_filename, frame.f_lineno)] = None

    def note_work(self, name: str) -> None:
        """Note that a clock is read that counts work."""
        self.note(WORK.format(name), is_asked=True)

    def watch_lines(self, path: Path) -> None:
        """Note when a line asks numpy for the time, or asyncio for what ends first."""
        source = path.read_bytes() if path.suffix == '.py' else b''
        if b'datetime64' not in source and b'as_completed' not in source:
            return
        for each in ast.walk(ast.parse(source)):
            if not isinstance(each, ast.Call):
                continue
            name, first = ast.unparse(each.func), each.args[0] if each.args else None
            is_now = isinstance(first, ast.Constant) and first.value in _NOW
            if name.endswith('datetime64') and is_now:
                self._lines.setdefault(str(path), {})[each.lineno] = _C_CLOCK
            elif name == 'asyncio.as_completed':
                self._lines.setdefault(str(path), {})[each.lineno] = _BY_ADDRESS
        if self._lines and self._threads.begin_tracing is None:
            self._threads.begin_tracing = lambda: sys.settrace(self._on_call)

    def _on_call(self, frame: FrameType, _event: str, _argument: object) -> Any:
        return self._on_line if frame.f_code.co_filename in self._lines else None

    def _on_line(self, frame: FrameType, event: str, _argument: object) -> Any:
        file = frame.f_code.co_filename
        if event == 'line' and (what := self._lines[file].get(frame.f_lineno)):
            self.notices[Notice(what, file, frame.f_lineno)] = None
        return self._on_line

    def telling(self) -> Iterator[tuple[ReplacedFunction | ReplacedMethod, Any]]:
        """Yield what tells something that is otherwise in another run, and what notes that."""
        for owner, names, what in _TELLING:
            for name in names:
                yield self._noted(owner, name, what.format(name))

    def _noted(
        self, owner: Any, name: str, what: str
    ) -> tuple[ReplacedFunction | ReplacedMethod, Any]:
        is_type = isinstance(owner, type)
        target = ReplacedMethod(owner, name) if is_type else ReplacedFunction(getattr(owner, name))
        original = target.original

        def call(*arguments: Any, **keywords: Any) -> Any:
            # Each callback asks for the number of its thread.
            path = sys._getframe(1).f_code.co_filename  # noqa: SLF001 - the only way
            is_own_business = path.startswith(_PACKAGE) and not path.startswith(_FOLDER)
            if not is_own_business and self._threads.mine() is not None:
                self.note(what, is_asked=True)
            return original(*arguments, **keywords)

        if callable(original):
            return target, call

        def read(instance: Any) -> Any:
            if self._threads.mine() is not None:
                self.note(what, is_asked=True)
            return original.__get__(instance)

        return target, property(read)


def _user_frame() -> FrameType | None:
    """Return the innermost call that is in no library; `None` if a library made it by itself."""
    frame: FrameType | None = sys._getframe(1)  # noqa: SLF001 - the only way
    while frame is not None:
        path = frame.f_code.co_filename
        if path.startswith(_PACKAGE) or f'{os.sep}rclpy{os.sep}' in path:
            if not path.startswith(_FOLDER):
                return None
        elif is_own_code(path):
            return frame
        frame = frame.f_back
    return None


def _asking_frame() -> FrameType | None:
    """Return the call of `_user_frame` if no library came between that asks for itself."""
    frame: FrameType | None = sys._getframe(2)  # noqa: SLF001 - the only way
    while frame is not None:
        path = frame.f_code.co_filename
        if is_own_code(path):
            return frame
        if not path.startswith(_FOLDER) and frame.f_globals.get('__name__') not in _PASSING:
            return None
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
