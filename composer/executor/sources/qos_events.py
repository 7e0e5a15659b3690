"""QoS events that need not be handled at once: the middleware is asked for them now and then.

It could announce all of them. But to arm one in Fast DDS takes the event's lock before the
reader's, and so does a take, while the delivery of an armed one takes them the other way round: a
deadlock (ros2/rmw_fastrtps pull request 890). So `WaitSetThread` waits for them, as rclpy does.

A system has thousands of them with rclpy's default callbacks, which log incompatible QoS; with
those in it, a wait would cost too much. To ask for 100 events takes 0.1 ms.
"""

import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from itertools import islice
from time import monotonic_ns, thread_time_ns
from typing import Any, Protocol, TypeVar

from rclpy.exceptions import InvalidHandle

from composer.executor.c_bindings import Readiness
from composer.executor.deadlines import Deadlines

_INTERVAL_NS = 1_000_000_000
_SHARE = 0.002
_MAX_AT_ONCE = 128

_Callback = TypeVar('_Callback', bound=Callable[..., Any])


def checked_seldom(callback: _Callback) -> _Callback:
    """Mark a callback of QoS events that may run a second late; a decorator."""
    marked: Any = callback
    marked.is_checked_seldom = True
    return callback


def is_checked_seldom(callback: Any) -> bool:
    """Tell whether a callback of QoS events is marked so, or rclpy's default."""
    # The module defines rclpy's default callbacks.
    is_default = getattr(callback, '__module__', '') == 'rclpy.event_handler'
    return is_default or getattr(callback, 'is_checked_seldom', False)


class QosEvent(Protocol):
    """An event that is asked for.

    Attributes:
        entity: Its `EventHandler`.
        rmw_event: The address of its `rmw_event_t`.
    """

    entity: Any
    rmw_event: int

    def set_ready(self) -> None:
        """Note that it has happened."""


class QosEventPoll:
    """Asks once a second for each of its events, for some of them at a time.

    If they are very many, it takes 0.2 % of the time, and as long as that takes.

    Args:
        deadlines: Say when to ask.
        readiness: Asks.
        lock: Held while the events are kept from being destroyed.
    """

    def __init__(self, deadlines: Deadlines, readiness: Readiness, lock: threading.Lock) -> None:
        self.deadline_ns: int | None = None
        self._deadlines = deadlines
        self._readiness = readiness
        self._lock = lock
        self._events: dict[QosEvent, None] = {}  # In the order in which to ask for them.

    def add(self, event: QosEvent) -> None:
        """Ask for `event`."""
        with self._lock:
            self._events[event] = None
            is_first = len(self._events) == 1
        if is_first:
            self._deadlines.set(self, monotonic_ns())

    def remove(self, event: QosEvent) -> None:
        """Undo `add`."""
        with self._lock:
            self._events.pop(event, None)

    def on_deadline(self) -> None:
        """Ask for those that are next."""
        begin_ns = thread_time_ns()
        with self._lock:
            events = list(islice(self._events, _MAX_AT_ONCE))
            for event in events:
                del self._events[event]
                self._events[event] = None
            happened = self._list_happened(events)
            count = len(self._events)
        for event in happened:
            event.set_ready()
        if count:
            interval_ns = _INTERVAL_NS * len(events) // count
            pause_ns = max(interval_ns, int((thread_time_ns() - begin_ns) / _SHARE))
            self._deadlines.set(self, monotonic_ns() + pause_ns)

    def _list_happened(self, events: list[QosEvent]) -> list[QosEvent]:
        with ExitStack() as held, suppress(InvalidHandle):
            asked = []
            for event in events:
                # One that has not been taken yet has happened all the time.
                if not event.entity._executor_event:  # noqa: SLF001
                    with suppress(InvalidHandle):
                        held.enter_context(event.entity)
                        asked.append(event)
            addresses = [event.rmw_event for event in asked]
            return [asked[index] for index in self._readiness.list_happened(addresses)]
        return []
