"""What a running system says of itself: to `composer ps`, and on `/diagnostics`."""

from __future__ import annotations

import os
import socket
import stat
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from composer.language.specs import SystemSpec


@record
class Outcome:
    """What came of a command.

    Attributes:
        succeeded: Whether it did what was asked.
        text: What was done, or the errors.
    """

    succeeded: bool
    text: str


@record
class ReloadReport:
    """The last reload.

    Attributes:
        time: When it ended, in seconds since the epoch.
    """

    time: float
    outcome: Outcome


class SystemState:
    """The state of a system, as it changes.

    Args:
        name: The system's name.
        file: Its file, as the user wrote it.

    Attributes:
        is_open: Whether its behaviours run; what waits may not have started.
        is_up: Whether it has started.
        is_stopping: Whether a stop was requested.
        last_reload: `None` before the first.
        find_lifecycles: Returns the states of the nodes with a lifecycle, by their full names.
        find_awaited: Returns what each node or process that has not started waits for, by the full
            name of the node or as in `process 'camera'`.
        find_processes: Returns the external processes, as `describe_processes` does.
        stopped: The full names of the nodes that somebody has stopped.
        clock_problem: What keeps the clocks of nodes from going; empty if nothing does.
        clocks: Those of other hosts that have been compared, by the names of these.
    """

    def __init__(self, name: str, file: str) -> None:
        self.name = name
        self.file = os.path.abspath(file) if os.path.exists(file) else file  # noqa: PTH100 - as written
        self.is_open = False
        self.is_up = False
        self.is_stopping = False
        self.last_reload: ReloadReport | None = None
        self.find_lifecycles: Callable[[], Mapping[str, str]] = dict
        self.find_awaited: Callable[[], Mapping[str, str]] = dict
        self.find_processes: Callable[[], list[dict[str, Any]]] = list
        self.stopped: list[str] = []
        self.clock_problem = ''
        self.begun = time.monotonic()
        self._started = time.time()
        self._reloads = 0

    @property
    def word(self) -> str:
        """The state in a word."""
        if self.is_stopping:
            return 'stopping'
        if not self.is_up:
            return 'starting'
        return 'reloading' if self._reloads else 'running'

    @property
    def last_error(self) -> str:
        """Why the last reload failed; empty if none did since."""
        last = self.last_reload
        return '' if last is None or last.outcome.succeeded else last.outcome.text

    @property
    def uptime_sec(self) -> float:
        """How long it has been running."""
        return time.monotonic() - self.begun

    @contextmanager
    def reloading(self) -> Iterator[None]:
        """Tell, until the block ends, that the system is being reloaded."""
        self._reloads += 1
        try:
            yield
        finally:
            self._reloads -= 1

    def note_reload(self, outcome: Outcome) -> None:
        """Note what came of a reload."""
        self.last_reload = ReloadReport(time.time(), outcome)

    def who(self) -> dict[str, Any]:
        """Return which system this is, and where it runs."""
        return {
            'name': self.name,
            'file': self.file,
            'host': socket.gethostname(),
            'pid': os.getpid(),
        }

    def document(self) -> dict[str, Any]:
        """Return all of it as data."""
        last = self.last_reload
        return {
            **self.who(),
            'state': self.word,
            'started': self._started,
            'uptime_sec': self.uptime_sec,
            'log': find_log(),
            'last_error': self.last_error,
            'stopped': self.stopped,
            'lifecycles': dict(self.find_lifecycles()),
            'awaited': dict(self.find_awaited()),
            'external_processes': self.find_processes(),
            'last_reload': last
            and {
                'time': last.time,
                'succeeded': last.outcome.succeeded,
                'message': last.outcome.text,
            },
        }


def system_title(spec: SystemSpec) -> str:
    """Return the name of a system; that of the part of one host has the host's name behind it."""
    return f'{spec.name}@{spec.host}' if spec.host else spec.name


def find_log() -> str | None:
    """Return the file that this process writes its log to; `None` if that is no file."""
    try:
        is_file = stat.S_ISREG(os.fstat(2).st_mode)
        return os.readlink('/proc/self/fd/2') if is_file else None  # noqa: PTH115
    except OSError:
        return None
