"""Errors of behaviours, and of other callbacks, in the log: each kind once, then counted."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.runtime.behaviours.tracebacks import format_behaviour_error, place_of, summarize

if TYPE_CHECKING:
    from collections.abc import Callable

# At most one line about the same entity in this time.
_QUIET_SEC = 1.0


@dataclass(slots=True)
class _ErrorCount:
    shown: set[tuple[str, str, int | None]] = field(default_factory=set)
    last_line: float = float('-inf')
    unreported: int = 0
    last_error: str = ''


class ErrorReporter:
    """Logs errors: each kind once with its traceback, then counts.

    Args:
        log: Takes the text, as the node's logger does.
    """

    def __init__(self, log: Callable[[str], Any]) -> None:
        self._log = log
        self._counts: dict[str, _ErrorCount] = {}
        self._lock = threading.Lock()

    def report(
        self,
        who: str,
        error: BaseException,
        format_error: Callable[[BaseException], str] = format_behaviour_error,
    ) -> None:
        """Log what was raised, or count it.

        Args:
            who: What raised it, as in `timer 'tick' (robot.yaml:7)`.
            format_error: Returns the traceback.
        """
        kind = (type(error).__name__, *place_of(error))
        summary = summarize(error)
        with self._lock:
            count = self._counts.setdefault(who, _ErrorCount())
            now = monotonic()
            if now - count.last_line < _QUIET_SEC:
                count.unreported += 1
                count.last_error = summary
                return
            if kind in count.shown:
                count.unreported += 1
                count.last_error = summary
                text = _format_count(who, count)
            else:
                count.shown.add(kind)
                earlier = f'{_format_count(who, count)}\n' if count.unreported else ''
                text = f'{earlier}{who} raised {summary}\n{format_error(error)}'.rstrip()
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
            for who, count in self._counts.items():
                if count.unreported and count.last_line <= before:
                    texts.append(_format_count(who, count))
                    count.last_line = monotonic()
        for text in texts:
            self._log(text)


def _format_count(who: str, count: _ErrorCount) -> str:
    """Return the line about the errors that were counted, and reset the count."""
    times = 'once more' if count.unreported == 1 else f'{count.unreported} more times'
    count.unreported = 0
    return f'{who} raised {times}, last: {count.last_error}'
