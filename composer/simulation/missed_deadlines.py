"""Missed deadlines in virtual time, for the behaviours that are to be called then.

The middleware counts them in real time, in threads of its own. As there (Fast DDS), the first
message begins the first period, and each missed one begins the next.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.runtime.nodes.live_node import LiveNode
    from composer.virtual_time.simulated_threads import SimulatedThreads

_KEY = 'on_deadline_missed'


@record
class DeadlineMissed:
    """What a behaviour is told, as rclpy's information about missed deadlines.

    Attributes:
        total_count: How many were missed.
        total_count_change: How many since the behaviour was called last.
    """

    total_count: int
    total_count_change: int


class _End:
    """A publisher or a subscription that has a deadline."""

    def __init__(self, entity: Any, period_ns: int, threads: SimulatedThreads) -> None:
        self._entity = entity
        self._period_ns = period_ns
        self._threads = threads
        self._count = 0
        self._call: Any = None

    def begin(self) -> None:
        """Begin a period now."""
        if self._call is not None:
            self._threads.cancel(self._call)
        self._call = self._threads.call_at(self._threads.now_ns + self._period_ns, self._miss)

    def _miss(self) -> None:
        self._count += 1
        self._entity.events.put(_KEY, DeadlineMissed(self._count, 1))
        self.begin()


class MissedDeadlines:
    """Tells publishers and subscriptions of the deadlines that they have missed."""

    def __init__(self, nodes: Iterable[LiveNode], threads: SimulatedThreads) -> None:
        self._heard: defaultdict[str, list[_End]] = defaultdict(list)
        self._published: defaultdict[tuple[str, str], list[_End]] = defaultdict(list)
        for node in nodes:
            for section in ('publishers', 'subscriptions'):
                for name, spec in getattr(node.spec, section).items():
                    if getattr(spec, _KEY, None) is None:
                        continue
                    entity: Any = node.entities[section][name]
                    period_ns = entity.ros.qos_profile.deadline.nanoseconds
                    end = _End(entity, period_ns, threads)
                    topic = entity.ros.topic_name
                    if section == 'publishers':
                        self._published[node.full_name, topic].append(end)
                    else:
                        self._heard[topic].append(end)

    def on_message(self, node: str, topic: str) -> None:
        """Note that a node has published on a topic."""
        for end in (*self._heard.get(topic, ()), *self._published.get((node, topic), ())):
            end.begin()
