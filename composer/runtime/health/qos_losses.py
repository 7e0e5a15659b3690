"""Missed deadlines and lost liveliness of topic ends: logged once, then counted."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.executor import checked_seldom

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# At most one line about the same loss in this time.
_QUIET_SEC = 10.0


@dataclass(slots=True)
class _LossCount:
    last_line: float = float('-inf')
    unreported: int = 0


class QosLosses:
    """What one publisher or subscription has missed of what its QoS promises.

    Args:
        describe: Returns what it is called in the log.
        policies: Its policies, where durations without a limit are left out.
        publishes: Whether it is a publisher.
        log: Takes the text, as the node's logger does.
    """

    def __init__(
        self,
        describe: Callable[[], str],
        policies: Mapping[str, Any],
        log: Callable[[str], Any],
        *,
        publishes: bool,
    ) -> None:
        self._describe = describe
        self._policies = policies
        self._publishes = publishes
        self._log = log
        self._counts: dict[str, _LossCount] = {}
        self._lock = threading.Lock()

    def callbacks(self) -> dict[str, Callable[[Any], None]]:
        """Return the callbacks of the QoS events that can occur, by rclpy's names of them."""
        callbacks: dict[str, Callable[[Any], None]] = {}
        if 'deadline' in self._policies:
            callbacks['deadline'] = self._on_missed_deadline
        if 'liveliness_lease_duration' in self._policies:
            callbacks['liveliness'] = (
                self._on_lost_liveliness if self._publishes else self._on_changed_liveliness
            )
        return callbacks

    def flush(self, before: float = float('inf')) -> None:
        """Log the counts of what was last logged before a time of `time.monotonic`."""
        with self._lock:
            due = {
                what: count
                for what, count in self._counts.items()
                if count.unreported and count.last_line <= before
            }
            lines = [self._format_count(what, count) for what, count in due.items()]
        for line in lines:
            self._log(line)

    def flush_old(self) -> None:
        """Log the counts of what was last logged long enough ago."""
        if self._counts:
            self.flush(monotonic() - _QUIET_SEC)

    @checked_seldom
    def _on_missed_deadline(self, event: Any) -> None:
        verb = 'published nothing' if self._publishes else 'got no message'
        deadline_sec = self._policies['deadline']
        self._report(f'{verb} within its deadline of {deadline_sec:g} s', event.total_count_change)

    @checked_seldom
    def _on_lost_liveliness(self, event: Any) -> None:
        lease_sec = self._policies['liveliness_lease_duration']
        what = f'lost its liveliness: it published nothing within its lease of {lease_sec:g} s'
        self._report(what, event.total_count_change)

    @checked_seldom
    def _on_changed_liveliness(self, event: Any) -> None:
        lease_sec = self._policies['liveliness_lease_duration']
        what = f'lost a publisher: no sign of life within the lease of {lease_sec:g} s'
        self._report(what, event.not_alive_count_change)

    def _report(self, what: str, times: int) -> None:
        if times <= 0:
            # A publisher that is alive again, or that has ended.
            return
        with self._lock:
            count = self._counts.setdefault(what, _LossCount())
            is_first = count.last_line == float('-inf')
            if is_first:
                count.last_line = monotonic()
            count.unreported += times - is_first
        if is_first:
            self._log(f'{self._describe()} {what}')

    def _format_count(self, what: str, count: _LossCount) -> str:
        """Return the line about what was counted, and reset the count."""
        times = 'once more' if count.unreported == 1 else f'{count.unreported} more times'
        count.unreported = 0
        count.last_line = monotonic()
        return f'{self._describe()} {what}, {times}'
