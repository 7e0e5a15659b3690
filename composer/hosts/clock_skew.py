"""How far the clock of a host is from the one here."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.hosts.agent_client import HostAgent

# Beyond this, stamps of messages mislead those who compare them with their own time.
MOST_SKEW_SEC = 0.05
_TRIPS = 8
_NS = 1e9


async def measure_skew(agent: HostAgent) -> tuple[float, float]:
    """Return how many seconds a host's clock is ahead, and how exactly that is known.

    As NTP does it: of several round trips the shortest, and its middle is when the host answered.
    """
    best = (float('inf'), 0.0)
    for _ in range(_TRIPS):
        sent_ns, begun = time.time_ns(), time.monotonic()
        there_ns = await agent.call('clock')
        trip_sec = time.monotonic() - begun
        middle_ns = sent_ns + trip_sec * _NS / 2
        best = min(best, (trip_sec, (there_ns - middle_ns) / _NS))
    return best[1], best[0] / 2


def describe_skew(host: str, skew_sec: float, error_sec: float) -> str | None:
    """Return a warning of a clock that differs; `None` for one that may be right."""
    if abs(skew_sec) <= MOST_SKEW_SEC + error_sec:
        return None
    word = 'ahead of' if skew_sec > 0 else 'behind'
    return (
        f'the clock of host {host} is {abs(skew_sec) * 1000:.0f} ms {word} the one here: '
        'let both follow the same NTP server'
    )
