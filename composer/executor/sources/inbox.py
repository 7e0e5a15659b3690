"""What is handed to a subscription or a service within the process."""

from __future__ import annotations

from collections import deque
from typing import Any


class Inbox:
    """The queue of a subscription or a service for what does not come through the middleware.

    They are executed before those of the middleware. It holds as many as the middleware would: a
    newer message pushes out the oldest.

    Args:
        depth: How many messages it holds; `None` for any number.

    Attributes:
        messages: The oldest first.
        source: The `EventSource` that takes them, while an executor listens to the entity.
        overruns: How many were pushed out.
    """

    __slots__ = ('depth', 'messages', 'overruns', 'source')

    def __init__(self, depth: int | None) -> None:
        self.depth = depth
        self.messages: deque[Any] = deque()
        self.source: Any = None
        self.overruns = 0

    def put(self, message: Any) -> None:
        """Hand over a message, which is the receiver's from now on."""
        source = self.source
        if source is not None:
            source.parts.scheduler.deliver(source, self, message)
            return
        self.add(message)
        if self.source is not None:  # It came meanwhile.
            self.source.parts.scheduler.add_events(self.source, 1)

    def add(self, message: Any) -> bool:
        """Add a message; return whether the queue is longer now."""
        messages = self.messages
        messages.append(message)
        if self.depth is None or len(messages) <= self.depth:
            return True
        self.overruns += 1
        messages.popleft()
        return False

    def is_drained(self) -> bool:
        """Tell whether the middleware has nothing more for the entity."""
        source = self.source
        return source is not None and not source.has_data()
