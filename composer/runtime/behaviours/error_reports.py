"""Errors of behaviours in the log: each kind once with its traceback, then counted."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.runtime.behaviours.tracebacks import format_behaviour_error, place_of, summarize

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.runtime.behaviours.running_calls import Owner

# At most one line about the same entity in this time.
_QUIET_SEC = 1.0


@dataclass(slots=True)
class _ErrorCount:
    shown: set[tuple[str, str, int | None]] = field(default_factory=set)
    last_line: float = float('-inf')
    unreported: int = 0
    last_error: str = ''


class ErrorReporter:
    """Logs the errors of one node's entities: each kind once with its traceback, then counts.

    Args:
        log: Takes the text, as the node's logger does.
    """

    def __init__(self, log: Callable[[str], Any]) -> None:
        self._log = log
        self._counts: dict[tuple[Owner, str], _ErrorCount] = {}
        self._lock = threading.Lock()

    def report(self, owner: Owner, place: str, error: BaseException) -> None:
        """Log what a behaviour raised, or count it.

        Args:
            place: Where the file declares it, as `file:line`.
        """
        kind = (type(error).__name__, *place_of(error))
        summary = summarize(error)
        with self._lock:
            count = self._counts.setdefault((owner, place), _ErrorCount())
            now = monotonic()
            if now - count.last_line < _QUIET_SEC:
                count.unreported += 1
                count.last_error = summary
                return
            if kind in count.shown:
                count.unreported += 1
                count.last_error = summary
                text = _format_count(owner, place, count)
            else:
                count.shown.add(kind)
                earlier = f'{_format_count(owner, place, count)}\n' if count.unreported else ''
                text = f'{earlier}{owner} ({place}) raised {format_behaviour_error(error)}'
            count.last_line = now
        self._log(text)

    def flush_old(self) -> None:
        """Log the counts of errors that are long enough ago."""
        if self._counts:
            self._flush(monotonic() - _QUIET_SEC)

    def flush(self) -> None:
        """Log the counts of all errors that have not been logged."""
        self._flush(float('inf'))

    def _flush(self, before: float) -> None:
        with self._lock:
            texts = []
            for (owner, place), count in self._counts.items():
                if count.unreported and count.last_line <= before:
                    texts.append(_format_count(owner, place, count))
                    count.last_line = monotonic()
        for text in texts:
            self._log(text)


def _format_count(owner: Owner, place: str, count: _ErrorCount) -> str:
    """Return the line about the errors that were counted, and reset the count."""
    times = 'once more' if count.unreported == 1 else f'{count.unreported} more times'
    count.unreported = 0
    return f'{owner} ({place}) raised {times}, last: {count.last_error}'
