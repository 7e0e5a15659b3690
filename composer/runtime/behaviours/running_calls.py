"""The calls of behaviours that are running: whose they are, since when, and where they are."""

from __future__ import annotations

import itertools
import threading
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.records import record
from composer.runtime.behaviours.stacks import (
    coroutine_codes,
    format_coroutine,
    format_thread,
    thread_codes,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import CodeType, CoroutineType

_MOST_LAST_CALLS = 5


class Progress:
    """When a behaviour that yields intermediate results was last resumed.

    Attributes:
        resumed_ns: A time of `time.monotonic_ns`.
    """

    __slots__ = ('resumed_ns',)

    def __init__(self) -> None:
        self.resumed_ns = 0

    def resume(self) -> None:
        """Note that it is resumed now."""
        self.resumed_ns = monotonic_ns()


@record
class Owner:
    """What a behaviour belongs to: an entity, or the node itself.

    Attributes:
        kind: The noun of the entity's kind, as in `timer`, or a key of the node, as in `on_start`.
        name: The entity's name.
        key: The key of the entity that names the behaviour, if it may have several.
    """

    kind: str
    name: str = ''
    key: str = ''

    def __str__(self) -> str:
        """Return `timer 'tick'`, `action client 'arm' (feedback)` or `on_start`."""
        name = f" '{self.name}'" if self.name else ''
        return f'{self.kind}{name}{f" ({self.key})" if self.key else ""}'


@record
class RunningCall:
    """A call that has begun and not ended.

    Attributes:
        begun_ns: When it began, by `time.monotonic_ns`.
        thread: The identifier of its thread, `None` for a coroutine.
        progress: Of a behaviour that yields intermediate results.
    """

    owner: Owner
    begun_ns: int
    thread: int | None
    coroutine: CoroutineType[Any, Any, Any] | None = None
    progress: Progress | None = None

    @property
    def since_ns(self) -> int:
        """When it began, or was last resumed after an intermediate result."""
        if self.progress is None:
            return self.begun_ns
        return max(self.begun_ns, self.progress.resumed_ns)

    def codes(self) -> Iterator[CodeType]:
        """Yield the code of each call that it is in now."""
        if self.coroutine is not None:
            return coroutine_codes(self.coroutine)
        return thread_codes(self.thread or 0)

    def format_stack(self) -> str:
        """Return where it is now, innermost call last."""
        if self.coroutine is not None:
            return format_coroutine(self.coroutine)
        return format_thread(self.thread or 0)


# The arguments of a `RunningCall`: to make one takes longer than everything else in a call.
_CallEntry: TypeAlias = (
    'tuple[Owner, int, int | None, CoroutineType[Any, Any, Any] | None, Progress | None]'
)


class RunningCalls:
    """The calls of a node's behaviours that have begun and not ended.

    Attributes:
        entries: The calls, by tokens; `None` for work that has no stack of its own.
        tokens: The token of the next entry.
        node: The full name of the node.
        last: Whose call ended last, and when it had begun, by `time.monotonic_ns`.
        has_listeners: Whether somebody must be told when an entry is removed.
    """

    __slots__ = (
        '_changed',
        '_end_listeners',
        '_waiters',
        'entries',
        'has_listeners',
        'last',
        'node',
        'tokens',
    )

    def __init__(self) -> None:
        self.entries: dict[int, _CallEntry | None] = {}
        self.tokens = itertools.count()
        self.node = ''
        self.last: tuple[Owner, int] | None = None
        self.has_listeners = False
        self._waiters = 0
        self._end_listeners: dict[int, Callable[[], None]] = {}
        self._changed = threading.Condition()

    def begin(self) -> int:
        """Add work that has no stack, and return its token for `end`."""
        token = next(self.tokens)
        self.entries[token] = None
        return token

    def end(self, token: int) -> None:
        """Remove a call or work that has ended."""
        del self.entries[token]
        if self.has_listeners:
            self.notify_end(token)

    def notify_end(self, token: int) -> None:
        """Tell the listener of an entry that it was removed, and wake those who wait for all."""
        with self._changed:
            listener = self._end_listeners.pop(token, None)
            self._update_listeners()
            if not self.entries:
                self._changed.notify_all()
        if listener is not None:
            listener()

    def on_end(self, token: int, listener: Callable[[], None]) -> None:
        """Call `listener` when an entry is removed, at once if it has been."""
        with self._changed:
            self._end_listeners[token] = listener
            self._update_listeners()
        if token not in self.entries:
            # It may have been removed before `has_listeners` was set.
            self.notify_end(token)

    def calls(self) -> list[RunningCall]:
        """Return the calls that run now."""
        return [RunningCall(*entry) for entry in list(self.entries.values()) if entry is not None]

    def wait_until_idle(self, timeout_sec: float) -> bool:
        """Wait until no call runs and no work is left; return whether that was in time."""
        with self._changed:
            self._waiters += 1
            # Set before the entries are looked at: whoever removes the last one sees it.
            self.has_listeners = True
            try:
                return self._changed.wait_for(lambda: not self.entries, timeout_sec)
            finally:
                self._waiters -= 1
                self._update_listeners()

    def _update_listeners(self) -> None:
        self.has_listeners = bool(self._waiters or self._end_listeners)


def describe_last_calls(running: Iterable[tuple[str, RunningCalls]]) -> str:
    """Return the calls that began last, a line for each: those that run, or have ended.

    Args:
        running: The keys of the nodes, and their calls.
    """
    found = []
    for node, calls in running:
        begun = [(call.owner, call.begun_ns) for call in calls.calls()]
        if calls.last is not None:
            begun.append(calls.last)
        found += [(begun_ns, node, str(owner)) for owner, begun_ns in begun]
    now_ns = monotonic_ns()
    return '\n'.join(
        f"  node '{node}': {owner}, {(now_ns - begun_ns) * 1e-9:.3f} s ago"
        for begun_ns, node, owner in sorted(found, reverse=True)[:_MOST_LAST_CALLS]
    )
