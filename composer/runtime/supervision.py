"""What happens when a behaviour raises: it is said once in full, counted after that, and acted on.

A behaviour that raises never takes another node down; this is the only place that decides more.
"""

from __future__ import annotations

import threading
import time
import traceback
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import OnError

# At most one line about the same entity in this time.
_QUIET_SEC = 1.0

_FIRST_BACKOFF_SEC = 0.1
_LONGEST_BACKOFF_SEC = 30.0
# A node that lived this long has recovered: the next restart is prompt again.
_RECOVERED_SEC = 60.0


@dataclass(slots=True)
class _ErrorCount:
    shown: set[tuple[str, str, int | None]] = field(default_factory=set)
    last_line: float = float('-inf')
    unsaid: int = 0
    last_error: str = ''


class ErrorReporter:
    """Logs the errors of one node's entities: each kind once with its traceback, then counts.

    Args:
        log: Takes the text, as the node's logger does.
    """

    def __init__(self, log: Callable[[str], Any]) -> None:
        self._log = log
        self._counts: dict[str, _ErrorCount] = {}
        self._lock = threading.Lock()

    def report(self, owner: str, place: str, error: BaseException) -> None:
        """Say that a behaviour raised.

        Args:
            owner: The entity in words, as in `timer 'tick'`.
            place: Where the file declares it, as `file:line`.
        """
        frames = traceback.extract_tb(error.__traceback__)
        line = frames[-1].lineno if frames else None
        kind = (type(error).__name__, frames[-1].filename if frames else '', line)
        summary = f'{type(error).__name__}: {error}'
        with self._lock:
            count = self._counts.setdefault(owner, _ErrorCount())
            now = time.monotonic()
            quiet = now - count.last_line < _QUIET_SEC
            if kind not in count.shown and not quiet:
                count.shown.add(kind)
                text = f'{owner} ({place}) raised {summary}\n{_format_traceback(error)}'
            elif quiet:
                count.unsaid += 1
                count.last_error = summary
                return
            else:
                text = f'{owner} ({place}) raised {count.unsaid + 1} more times, last: {summary}'
            count.last_line, count.unsaid = now, 0
        self._log(text)

    def flush(self) -> None:
        """Say the counts that have not been said yet."""
        with self._lock:
            pending = [(owner, count) for owner, count in self._counts.items() if count.unsaid]
            texts = [
                f'{owner} raised {count.unsaid} more times, last: {count.last_error}'
                for owner, count in pending
            ]
            for _, count in pending:
                count.unsaid = 0
        for text in texts:
            self._log(text)


def _format_traceback(error: BaseException) -> str:
    """Return the traceback without Composer's own frames at its beginning."""
    own = f'{__name__.partition(".")[0]}.'
    trace = error.__traceback__
    while (
        trace and trace.tb_next and str(trace.tb_frame.f_globals.get('__name__')).startswith(own)
    ):
        trace = trace.tb_next
    return ''.join(traceback.format_exception(type(error), error, trace)).rstrip()


@dataclass(slots=True)
class Backoff:
    """How long to wait before the next restart of a node: from 0.1 s, doubled, to 30 s."""

    _delay_sec: float = _FIRST_BACKOFF_SEC
    _last_restart: float = float('-inf')

    def next_delay_sec(self) -> float:
        """Return the delay before the restart that is due now."""
        now = time.monotonic()
        if now - self._last_restart > _RECOVERED_SEC:
            self._delay_sec = _FIRST_BACKOFF_SEC
        delay = self._delay_sec
        self._delay_sec = min(delay * 2, _LONGEST_BACKOFF_SEC)
        self._last_restart = now + delay
        return delay


class Supervisor:
    """Acts on errors as `on_error` says.

    Args:
        restart: Rebuilds the node of this name.
        shutdown: Ends the system with this exit code.
    """

    def __init__(self, restart: Callable[[str], None], shutdown: Callable[[int], None]) -> None:
        self._restart = restart
        self._shutdown = shutdown
        self._backoffs: dict[str, Backoff] = {}
        self._restarting: set[str] = set()
        self._lock = threading.Lock()
        self._stopped = threading.Event()

    def act(self, node: str, on_error: OnError) -> None:
        """Do what `on_error` says about an error of a node."""
        if on_error == 'shutdown':
            self._shutdown(1)
        elif on_error == 'restart':
            with self._lock:
                if node in self._restarting:
                    return
                self._restarting.add(node)
            # The behaviour that raised is one of the node's callbacks: it must end first.
            threading.Thread(
                target=self._restart_later, args=(node,), name=f'restart-{node}', daemon=True
            ).start()

    def stop(self) -> None:
        """Restart no more nodes."""
        self._stopped.set()

    def _restart_later(self, node: str) -> None:
        backoff = self._backoffs.setdefault(node, Backoff())
        stopped = self._stopped.wait(backoff.next_delay_sec())
        with self._lock:
            self._restarting.discard(node)
        if not stopped:
            self._restart(node)
