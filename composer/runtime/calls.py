"""The wrapper around every behaviour: it runs it, keeps account of it, and catches everything.

It is on the way of every message, so it is made of plain functions and tuples: a hundred
nanoseconds here are what composing costs.
"""

from __future__ import annotations

import itertools
import sys
import threading
import time
import traceback
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.python_source import FunctionKind
from composer.runtime.behaviours import kind_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CoroutineType, FrameType

    from composer.runtime.health import CallTimes


@dataclass(frozen=True, slots=True)
class RunningCall:
    """A behaviour that has begun and not ended.

    Attributes:
        begun_ns: When it began, by `time.monotonic_ns`.
        thread: The identifier of its thread, `None` for a coroutine.
    """

    owner: str
    begun_ns: int
    thread: int | None
    coroutine: CoroutineType[Any, Any, Any] | None = None

    def format_stack(self) -> str:
        """Return where it is now, innermost call last."""
        if self.coroutine is not None:
            frame: FrameType | None = getattr(self.coroutine, 'cr_frame', None)
        else:
            frame = sys._current_frames().get(self.thread or 0)  # noqa: SLF001 - the only way
        return ''.join(traceback.format_stack(frame)).rstrip() if frame else '  (it has ended)'


# The arguments of a `RunningCall`: to make one takes longer than all other bookkeeping.
_CallEntry: TypeAlias = 'tuple[str, int, int | None, CoroutineType[Any, Any, Any] | None]'


class CallLedger:
    """The behaviours of a node that are running.

    Attributes:
        entries: What runs, by tokens; `None` for what has no stack of its own.
        tokens: What to call the next entry.
        is_awaited: Whether somebody must be told when the last entry has gone.
    """

    __slots__ = ('_changed', '_waiters', 'entries', 'is_awaited', 'tokens')

    def __init__(self) -> None:
        self.entries: dict[int, _CallEntry | None] = {}
        self.tokens = itertools.count()
        self.is_awaited = False
        self._waiters = 0
        self._changed = threading.Condition()

    def begin(self) -> int:
        """Note something that is still to be done but has no stack; return what `end` takes."""
        token = next(self.tokens)
        self.entries[token] = None
        return token

    def end(self, token: int) -> None:
        """Note that it has been done, or that a behaviour has ended."""
        del self.entries[token]
        if self.is_awaited:
            self.tell_if_idle()

    def tell_if_idle(self) -> None:
        """Wake those who wait for the last entry to go, if it has gone."""
        if not self.entries:
            with self._changed:
                self._changed.notify_all()

    def running(self) -> list[RunningCall]:
        """Return the behaviours that run now."""
        return [RunningCall(*entry) for entry in list(self.entries.values()) if entry is not None]

    def wait_until_idle(self, timeout_sec: float) -> bool:
        """Wait until no behaviour runs; return whether that came to be in time."""
        with self._changed:
            self._waiters += 1
            # Said before the entries are looked at: whoever takes the last one away sees it.
            self.is_awaited = True
            try:
                return self._changed.wait_for(lambda: not self.entries, timeout_sec)
            finally:
                self._waiters -= 1
                self.is_awaited = self._waiters > 0


class BehaviourCall:
    """A function bound to an entity, as a callback for rclpy.

    Args:
        function: Called with the callback's arguments.
        deliver: Takes what the function returned.
        failed: Takes what it raised.
        times: Hears how long each call took; `None` measures nothing.

    Attributes:
        run: Calls a plain function; returns whether it did not raise.
    """

    __slots__ = ('_deliver', '_failed', '_function', '_ledger', '_owner', '_times', 'run')

    def __init__(
        self,
        owner: str,
        function: Callable[..., Any],
        ledger: CallLedger,
        *,
        deliver: Callable[[Any], None],
        failed: Callable[[str, BaseException], None],
        times: CallTimes | None = None,
    ) -> None:
        self._owner = owner
        self._function = function
        self._ledger = ledger
        self._deliver = deliver
        self._failed = failed
        self._times = times
        self.run: Callable[..., bool] = self._compile()

    def delivering(self, deliver: Callable[[Any], None]) -> BehaviourCall:
        """Return the same call with its result going elsewhere."""
        return BehaviourCall(
            self._owner,
            self._function,
            self._ledger,
            deliver=deliver,
            failed=self._failed,
            times=self._times,
        )

    def as_callback(self, kind: FunctionKind | None = None) -> Callable[..., Any]:
        """Return what rclpy calls or awaits; it never raises."""
        asynchronous = (kind or kind_of(self._function)) is FunctionKind.COROUTINE
        # rclpy looks at the callback itself to tell what to await, and how many arguments it
        # takes: a message callback with one, a timer callback with none.
        return self._compile_async() if asynchronous else self.run

    def _compile(self) -> Callable[..., bool]:
        """Return the call of a plain function as one function, with all that it needs at hand."""
        owner, function, deliver, failed = (
            self._owner,
            self._function,
            self._deliver,
            self._failed,
        )
        ledger, entries, tokens = self._ledger, self._ledger.entries, self._ledger.tokens
        add_time = None if self._times is None else self._times.add
        now_ns, get_thread = time.monotonic_ns, threading.get_ident

        def call_behaviour(*arguments: Any) -> bool:
            token = next(tokens)
            begun_ns = now_ns()
            entries[token] = (owner, begun_ns, get_thread(), None)
            try:
                deliver(function(*arguments))
            except BaseException as error:  # noqa: BLE001 - it never takes another node down
                failed(owner, error)
                return False
            finally:
                if add_time is not None:
                    add_time(now_ns() - begun_ns)
                # As `ledger.end` does.
                del entries[token]
                if ledger.is_awaited:
                    ledger.tell_if_idle()
            return True

        return call_behaviour

    def _compile_async(self) -> Callable[..., Any]:
        ledger, times = self._ledger, self._times

        async def await_behaviour(*arguments: Any) -> None:
            begun_ns = time.monotonic_ns()
            token = None
            try:
                # A wrapper of an async function may itself be a plain one, and raise at once.
                coroutine: CoroutineType[Any, Any, Any] = self._function(*arguments)
                token = next(ledger.tokens)
                ledger.entries[token] = (self._owner, begun_ns, None, coroutine)
                self._deliver(await coroutine)
            except GeneratorExit:
                # The executor drops the coroutine; to go on here would be an error of Python's.
                raise
            except BaseException as error:  # noqa: BLE001 - as above
                self._failed(self._owner, error)
            finally:
                if times is not None:
                    times.add(time.monotonic_ns() - begun_ns)
                if token is not None:
                    ledger.end(token)

        return await_behaviour
