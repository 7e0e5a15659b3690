"""How far the clock of another host is from the one here, as NTP finds it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable

# Beyond this, stamps of messages mislead those who compare them with their own time.
MOST_SKEW_SEC = 0.05
# Of so many round trips the shortest counts.
TRIPS = 8
_NS = 1e9


@record
class ClockTrip:
    """A question for the time of another host, and its answer.

    Attributes:
        sent_ns: The time here when it was asked.
        there_ns: The time there when it answered.
        trip_sec: How long the answer took.
    """

    sent_ns: int
    there_ns: int
    trip_sec: float

    @property
    def skew_sec(self) -> float:
        """How far that clock is ahead, if the answer was given in the middle of the trip."""
        return (self.there_ns - self.sent_ns) / _NS - self.trip_sec / 2


def find_skew(trips: Iterable[ClockTrip]) -> tuple[float, float]:
    """Return how many seconds a clock is ahead, and how exactly that is known."""
    best = min(trips, key=lambda each: each.trip_sec)
    return best.skew_sec, best.trip_sec / 2


async def measure_skew(ask: Callable[[], Awaitable[int]]) -> tuple[float, float]:
    """Ask for the time of a host, and return what `find_skew` does.

    Args:
        ask: Returns the time there, in nanoseconds.
    """
    trips = []
    for _ in range(TRIPS):
        sent_ns, begun = time.time_ns(), time.monotonic()
        there_ns = await ask()
        trips.append(ClockTrip(sent_ns, there_ns, time.monotonic() - begun))
    return find_skew(trips)


def describe_skew(host: str, skew_sec: float, error_sec: float, here: str = '') -> str | None:
    """Return a warning of a clock that differs; `None` for one that may be right.

    Args:
        here: The host that compares it with its own; empty for a computer that is none.
    """
    if abs(skew_sec) <= MOST_SKEW_SEC + error_sec:
        return None
    word = 'ahead of' if skew_sec > 0 else 'behind'
    other = f'that of host {here}' if here else 'the one here'
    return (
        f'the clock of host {host} is {abs(skew_sec) * 1000:.0f} ms {word} {other}: '
        'let both follow the same NTP server, as chrony and systemd-timesyncd do'
    )
