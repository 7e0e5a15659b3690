"""Messages that are lost, late or doubled on their way, as a test wants it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from rclpy.exceptions import InvalidHandle

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.virtual_time.simulated_threads import SimulatedThreads

TopicFaultKind: TypeAlias = Literal['drop', 'delay', 'duplicate']


@record
class TopicFault:
    """What happens to the messages of a topic.

    Attributes:
        end_ns: The first time at which it happens no more; `None` for never.
        delay_ns: How much later they come.
    """

    kind: TopicFaultKind
    topic: str
    end_ns: int | None
    delay_ns: int


class TopicFaults:
    """The faults of a simulation, each from when it is added."""

    def __init__(self, threads: SimulatedThreads) -> None:
        self._threads = threads
        self._faults: list[TopicFault] = []

    def add(self, fault: TopicFault) -> None:
        """Have it happen from now on."""
        self._faults.append(fault)

    def take(self, topic: str, copy: Callable[[], Any], deliver: Callable[[Any], None]) -> bool:
        """Return whether a message that is published must not be delivered now.

        Args:
            copy: Returns the message anew.
            deliver: Delivers a message.
        """
        now_ns = self._threads.now_ns
        faults = [
            each
            for each in self._faults
            if each.topic == topic and (each.end_ns is None or now_ns < each.end_ns)
        ]
        kinds = [each.kind for each in faults]
        if 'drop' in kinds:
            return True
        delay_ns = sum(each.delay_ns for each in faults)
        more = kinds.count('duplicate')
        for _ in range(more + 1 if delay_ns else more):
            if delay_ns:
                self._threads.call_at(now_ns + delay_ns, partial(self._begin, deliver, copy()))
            else:
                deliver(copy())
        return delay_ns > 0

    def _begin(self, deliver: Callable[[Any], None], message: Any) -> None:
        self._threads.start(_deliver_late, deliver, message)


def _deliver_late(deliver: Callable[[Any], None], message: Any) -> None:
    # Its publisher may have gone meanwhile.
    with suppress(InvalidHandle):
        deliver(message)
