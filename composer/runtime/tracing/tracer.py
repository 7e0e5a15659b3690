"""Notes callbacks, waits, calls, goals, messages and queues while it is on."""

from __future__ import annotations

import itertools
import math
import threading
from contextlib import contextmanager, suppress
from threading import get_ident
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.executor.sources.inbox import Inbox
    from composer.runtime.behaviours.running_calls import RunningCalls

EventKind: TypeAlias = Literal[
    'callback', 'publish', 'arrow', 'call', 'wait', 'goal', 'queue', 'dropped', 'late'
]
# Kind, node, track, name, begin and end (ns), value. A track is the identifier of a thread, or a
# word for what holds none. The value of a callback or an arrow is the number of the arrow (0 for
# none), of a queue its length, of a late tick by how much (ns). An arrow begins with the message
# that its thread published at that time.
TraceEvent: TypeAlias = 'tuple[EventKind, str, int | str, str, int, int, int]'

# Less than 100 MB.
MOST_EVENTS: Final = 500_000
COROUTINE: Final = 'coroutine'
MARKS: Final = 'marks'
_FIELDS: Final = 7


class TracePart(NamedTuple):
    """What one process has noted, which JSON takes as a list.

    Attributes:
        begun_ns: When it began, by `time.monotonic_ns`.
        threads: The names of threads that are still there, by their identifiers as text.
        lost: How many events were left out, as there were too many.
    """

    begun_ns: int
    ended_ns: int
    threads: dict[str, str]
    events: list[TraceEvent]
    lost: int


class Tracer:
    """Notes what happens in this process, from `turn_on` until `take`.

    Attributes:
        is_on: Whether it does.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._begun_ns = 0
        self._clear()

    def _clear(self) -> None:
        # Their fields one after the other: so many tuples would keep the garbage collector busy.
        self._fields: list[Any] = []
        self._lost = 0
        self._last_ns = 0
        self._arrows = itertools.count(1)
        # What is handed over and not run yet, by the identity of the message.
        self._waiting: dict[int, list[tuple[int, TracedInbox]]] = {}
        # When each thread published last.
        self._publications: dict[int, int] = {}

    def turn_on(self, begun_ns: int | None = None) -> None:
        """Begin, or begin anew.

        Args:
            begun_ns: When virtual time begins; `None` for now.
        """
        self._clear()
        self._begun_ns = self.now_ns() if begun_ns is None else begun_ns
        self.is_on = True

    def take(self, running: Iterable[tuple[str, RunningCalls]]) -> TracePart:
        """Turn off, and return what was noted.

        Args:
            running: The calls that run on, with the full names of their nodes.
        """
        self.is_on = False
        ended_ns, fields = self.now_ns(), iter(self._fields)
        events: list[TraceEvent] = [
            (kind, node, track, str(name), begun_ns, end_ns, value)
            for kind, node, track, name, begun_ns, end_ns, value in zip(
                *[fields] * _FIELDS, strict=True
            )
        ]
        for node, calls in running:
            for call in calls.calls():
                track = COROUTINE if call.thread is None else call.thread
                begun_ns = max(call.begun_ns, self._begun_ns)
                name = f'{call.owner} (runs on)'
                events.append(('callback', node, track, name, begun_ns, ended_ns, 0))
        threads = {str(each.ident): each.name for each in threading.enumerate()}
        part = TracePart(self._begun_ns, ended_ns, threads, events, self._lost)
        self._clear()
        return part

    def now_ns(self) -> int:
        """Return the time; it is never the same twice, though virtual time stands still."""
        now_ns = monotonic_ns()
        if now_ns <= self._last_ns:
            now_ns = self._last_ns + 1
        self._last_ns = now_ns
        return now_ns

    def begin(self, arguments: tuple[Any, ...] = ()) -> tuple[int, int]:
        """Return what `end` is to be told of what begins now.

        Args:
            arguments: Those of a callback: a message that was handed over has an arrow.
        """
        now_ns, arrow = self.now_ns(), 0
        if arguments and (waiting := self._waiting.pop(id(arguments[0]), None)):
            for _, inbox in waiting:
                self._add(('queue', *inbox.place, now_ns, now_ns, len(inbox.messages)))
            arrow, _ = waiting.pop()
            if waiting:
                # Others share the message.
                self._waiting[id(arguments[0])] = waiting
        return now_ns, arrow

    def end(
        self, kind: EventKind, node: str, name: object, begun: tuple[int, int], track: str = ''
    ) -> None:
        """Note what ends now.

        Args:
            begun: See `begin`.
            track: Of what holds no thread.
        """
        begun_ns, arrow = begun
        if begun_ns >= self._begun_ns:
            place = track or get_ident()
            self._add((kind, node, place, name, begun_ns, self.now_ns(), arrow))

    @contextmanager
    def waiting(self, node: str, what: str, track: str = '') -> Iterator[None]:
        """Note that a behaviour waits for something in the block."""
        begun = self.begin() if self.is_on else None
        try:
            yield
        finally:
            if begun is not None:
                self.end('wait', node, what, begun, track)

    def note(self, kind: EventKind, node: str, name: str, value: int) -> None:
        """Note a length, or that something was dropped or late."""
        now_ns = self.now_ns()
        self._add((kind, node, MARKS, name, now_ns, now_ns, value))

    def _add(self, event: tuple[Any, ...]) -> None:
        if len(self._fields) < MOST_EVENTS * _FIELDS:
            self._fields += event
        else:
            self._lost += len(event) // _FIELDS

    def create_tap(self, node: str, topic: str) -> Callable[[Any], None]:
        """Return what notes a message that is published."""

        def tap(_message: Any) -> None:
            thread, now_ns = get_ident(), self.now_ns()
            self._publications[thread] = now_ns
            self._add(('publish', node, thread, topic, now_ns, now_ns, 0))

        return tap

    def hand_over(self, message: Any, inbox: TracedInbox) -> None:
        """Note that what this thread publishes comes into a queue now."""
        thread = get_ident()
        begun_ns = self._publications.get(thread)
        if not self.is_on or begun_ns is None:
            return
        messages, (node, track, name) = inbox.messages, inbox.place
        now_ns, arrow, length = self.now_ns(), next(self._arrows), len(messages) + 1
        if length > inbox.most:
            length -= 1
            with suppress(IndexError):  # Another thread was faster.
                self._waiting.pop(id(messages[0]), None)
            self._add(('dropped', node, track, name, now_ns, now_ns, 1))
        if (waiting := self._waiting.get(id(message))) is None:
            self._waiting[id(message)] = [(arrow, inbox)]
        else:
            waiting.append((arrow, inbox))
        # Two events at once.
        self._add(
            (
                *('arrow', node, thread, name, begun_ns, now_ns, arrow),
                *('queue', node, track, name, now_ns, now_ns, length),
            )
        )


class TracedInbox:
    """Stands for the queue of a subscription where messages are put into it.

    Args:
        what: The subscription, as its callbacks are called.

    Attributes:
        messages: Those of the queue.
        most: How many it holds.
        place: Node, track and name of its length.
    """

    def __init__(self, node: Any, what: str, inbox: Inbox) -> None:
        self.messages = inbox.messages
        self.most = math.inf if inbox.depth is None else inbox.depth
        self.place = node.get_fully_qualified_name(), MARKS, what
        self._put = inbox.put

    def put(self, message: Any) -> None:
        """See `Inbox`."""
        tracer.hand_over(message, self)
        self._put(message)


tracer = Tracer()
