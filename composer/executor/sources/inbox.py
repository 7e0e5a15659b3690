"""What is handed to a subscription, a service or an action within the process."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import suppress
from time import monotonic_ns
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


class Inbox:
    """The queue of an entity for what does not come through the middleware.

    They are executed before those of the middleware. It holds as many as the middleware would: a
    newer message pushes out the oldest.

    Args:
        depth: How many messages it holds; `None` for any number.

    Attributes:
        messages: The oldest first.
        source: The `EventSource` that takes them, while an executor listens to the entity.
        overruns: How many were pushed out.
        timings: How many of the next messages are timed.
        put_ns: When those of these that wait were put here, by their `id`.
        tap: Called with each message before it is put here, if there is one.
    """

    __slots__ = (
        '_heir',
        '_passing_on',
        'depth',
        'messages',
        'overruns',
        'put_ns',
        'source',
        'tap',
        'timings',
    )

    def __init__(self, depth: int | None) -> None:
        self.depth = depth
        self.messages: deque[Any] = deque(maxlen=depth)
        self.source: Any = None
        self.overruns = 0
        self.timings = 0
        self.put_ns: dict[int, int] = {}
        self.tap: Callable[[Any], object] | None = None
        self._heir: Inbox | None = None
        self._passing_on = threading.RLock()

    def put(self, message: Any) -> None:
        """Hand over a message, which is the receiver's from now on."""
        messages, tap = self.messages, self.tap
        if tap is not None:
            tap(message)
        if len(messages) == self.depth:
            self.overruns += 1
        if self.timings:
            self.timings -= 1
            self.put_ns[id(message)] = monotonic_ns()
        messages.append(message)
        if self._heir is not None:
            self.pass_on(self._heir)
        source = self.source
        if source is not None:
            source.parts.scheduler.add_events(source, 0)

    def pass_on(self, heir: Inbox) -> None:
        """Move what waits to the end of another queue, and all that is still put here."""
        self._heir = heir
        with self._passing_on, suppress(IndexError):
            while True:
                heir.put(self.messages.popleft())

    def limit_beside(self, others: int) -> None:
        """Push out the oldest, so that there are no more than the depth with `others`."""
        if self.depth is None:
            return
        for _ in range(len(self.messages) + min(others, self.depth) - self.depth):
            with suppress(IndexError):  # Another thread was faster.
                self.messages.popleft()
                self.overruns += 1

    def is_drained(self) -> bool:
        """Tell whether the middleware has nothing more for the entity."""
        source = self.source
        return source is not None and not source.has_data()
