"""Notes callbacks, waits, calls, goals, messages and queues while it is on."""

from __future__ import annotations

import itertools
import threading
from collections import defaultdict
from contextlib import contextmanager, suppress
from operator import itemgetter
from threading import get_ident
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.executor.sources.inbox import Inbox
    from composer.runtime.behaviours.running_calls import RunningCalls

EventKind: TypeAlias = Literal[
    'callback', 'publish', 'call', 'wait', 'goal', 'queue', 'dropped', 'late'
]
# Kind, node, track, name, begin and end (ns), value. A track is the identifier of a thread, or a
# word for what holds none. The value of a message is the list of its arrows, of a callback the
# arrow that ends there (0 for none), of a queue its length, of a late tick by how much (ns).
TraceEvent: TypeAlias = 'list[Any]'

# Less than 100 MB.
MOST_EVENTS: Final = 500_000
COROUTINE: Final = 'coroutine'
MARKS: Final = 'marks'
_FIELDS: Final = 7
_BEGUN_NS, _ENDED_NS, _VALUE = 4, 5, 6
# What is noted of messages, with the queue as its node and the message's identity as its name.
_HANDED_OVER: Final = 'handed over'
_PUSHED_OUT: Final = 'pushed out'


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

    As little as possible is done where something happens. What belongs together, as a message
    that is handed over and the callback that takes it, `take` finds out.

    Attributes:
        is_on: Whether it does.
        now_ns: Returns the time.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._begun_ns = self._last_ns = 0
        self.now_ns = monotonic_ns
        self._clear()

    def _clear(self) -> None:
        # Their fields one after the other: so many tuples would keep the garbage collector busy.
        self._fields: list[Any] = []
        self._lost = 0

    def add(self, event: tuple[Any, ...]) -> None:
        """Note an event."""
        if len(self._fields) < MOST_EVENTS * _FIELDS:
            self._fields.extend(event)
        else:
            self._lost += 1

    def turn_on(self, begun_ns: int | None = None) -> None:
        """Begin, or begin anew.

        Args:
            begun_ns: When virtual time begins; `None` for now.
        """
        self._clear()
        self.now_ns = monotonic_ns if begun_ns is None else self._next_ns
        self._begun_ns = self._last_ns = monotonic_ns() if begun_ns is None else begun_ns
        self.is_on = True

    def _next_ns(self) -> int:
        """Return the time; it is never the same twice, though virtual time stands still."""
        self._last_ns = max(monotonic_ns(), self._last_ns + 1)
        return self._last_ns

    def take(self, running: Iterable[tuple[str, RunningCalls]]) -> TracePart:
        """Turn off, and return what was noted.

        Args:
            running: The calls that run on, with the full names of their nodes.
        """
        self.is_on = False
        ended_ns, fields = self.now_ns(), iter(self._fields)
        noted = sorted(zip(*[fields] * _FIELDS, strict=True), key=itemgetter(_BEGUN_NS))
        events = list(_find_arrows(noted))
        for node, calls in running:
            for call in calls.calls():
                track = COROUTINE if call.thread is None else call.thread
                begun_ns = max(call.begun_ns, self._begun_ns)
                name = f'{call.owner} (runs on)'
                events.append(['callback', node, track, name, begun_ns, ended_ns, 0])
        threads = {str(each.ident): each.name for each in threading.enumerate()}
        part = TracePart(self._begun_ns, ended_ns, threads, events, self._lost)
        self._clear()
        return part

    def begin(self, arguments: tuple[Any, ...] = ()) -> tuple[int, int]:
        """Return what `end` is to be told of what begins now.

        Args:
            arguments: Those of a callback: a message that was handed over has an arrow.
        """
        return self.now_ns(), id(arguments[0]) if arguments else 0

    def end(
        self, kind: EventKind, node: str, name: object, begun: tuple[int, int], track: str = ''
    ) -> None:
        """Note what ends now.

        Args:
            begun: See `begin`.
            track: Of what holds no thread.
        """
        begun_ns, message = begun
        if begun_ns >= self._begun_ns:
            place = track or get_ident()
            self.add((kind, node, place, name, begun_ns, self.now_ns(), message))

    @contextmanager
    def noting(self, kind: EventKind, node: str, name: str, track: str = '') -> Iterator[None]:
        """Note what the block does; see `end`."""
        begun = self.begin() if self.is_on else None
        try:
            yield
        finally:
            if begun is not None:
                self.end(kind, node, name, begun, track)

    def note(self, kind: EventKind, node: str, name: str, value: int) -> None:
        """Note a length, or that something was dropped or late."""
        now_ns = self.now_ns()
        self.add((kind, node, MARKS, name, now_ns, now_ns, value))

    def create_tap(self, node: str, topic: str) -> Callable[[Any], None]:
        """Return what notes a message that is published."""

        def tap(_message: Any) -> None:
            now_ns = self.now_ns()
            self.add(('publish', node, get_ident(), topic, now_ns, now_ns, 0))

        return tap

    def create_inbox_tap(self, node: Any, what: str, inbox: Inbox) -> Callable[[Any], None]:
        """Return what notes a message that is put into the queue of a subscription.

        Args:
            what: The subscription, as its callbacks are called.
        """
        queue, messages = (node.get_fully_qualified_name(), what), inbox.messages

        def tap(message: Any) -> None:
            length, now_ns = len(messages) + 1, self.now_ns()
            if inbox.depth is not None and length > inbox.depth:
                with suppress(IndexError):  # Another thread was faster.
                    self.add((_PUSHED_OUT, queue, 0, id(messages[0]), now_ns, now_ns, 0))
                length -= 1
            self.add((_HANDED_OVER, queue, get_ident(), id(message), now_ns, now_ns, length))

        return tap


def _find_arrows(noted: Iterable[tuple[Any, ...]]) -> Iterator[TraceEvent]:
    """Yield events for what was noted, in the order in which it began."""
    arrows = itertools.count(1)
    # What each thread published last.
    publications: dict[int, TraceEvent] = {}
    # What is handed over and not run yet, by the identity of the message: others may share it.
    waiting: defaultdict[int, dict[tuple[str, str], int]] = defaultdict(dict)
    lengths: dict[tuple[str, str], int] = {}
    for kind, node, track, name, begun_ns, ended_ns, value in noted:
        queue = node if kind in (_PUSHED_OUT, _HANDED_OVER) else (node, str(name))
        if kind == _PUSHED_OUT:
            waiting[name].pop(queue, None)
            yield ['dropped', queue[0], MARKS, queue[1], begun_ns, begun_ns, 1]
        elif kind == _HANDED_OVER:
            if (publication := publications.get(track)) is not None:
                lengths[queue] = value
                waiting[name][queue] = arrow = next(arrows)
                publication[_ENDED_NS] = begun_ns
                publication[_VALUE].append(arrow)
                yield ['queue', queue[0], MARKS, queue[1], begun_ns, begun_ns, value]
        elif kind == 'callback':
            if arrow := waiting[value].pop(queue, 0):
                lengths[queue] = max(0, lengths[queue] - 1)
                yield ['queue', node, MARKS, queue[1], begun_ns, begun_ns, lengths[queue]]
            yield [kind, node, track, queue[1], begun_ns, ended_ns, arrow]
        elif kind == 'publish':
            publications[track] = [kind, node, track, name, begun_ns, ended_ns, []]
            yield publications[track]
        else:
            yield [kind, node, track, name, begun_ns, ended_ns, value]


tracer = Tracer()
