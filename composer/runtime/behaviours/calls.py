"""The wrapper around every behaviour: it runs it, keeps account of it, and catches everything.

It is on the way of every message, so it is made of plain functions and tuples: a hundred
nanoseconds here are what composing costs.
"""

from __future__ import annotations

import itertools
import threading
from dataclasses import dataclass
from threading import get_ident
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.executor.after_fork import end_child
from composer.python_source.modules import FunctionKind
from composer.runtime import forked_children
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.stacks import format_coroutine, format_thread

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CoroutineType


class Pace:
    """When a behaviour that hands out intermediate results went on the last time.

    Attributes:
        resumed_ns: A time of `time.monotonic_ns`.
    """

    __slots__ = ('resumed_ns',)

    def __init__(self) -> None:
        self.resumed_ns = 0

    def resumed(self) -> None:
        """Measure from now on."""
        self.resumed_ns = monotonic_ns()


@dataclass(frozen=True, slots=True)
class Owner:
    """What a behaviour belongs to: an entity, or the node itself.

    Attributes:
        kind: The noun of the entity's kind, as in `timer`, or the key of a node, as in `on_start`.
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


@dataclass(frozen=True, slots=True)
class RunningCall:
    """A behaviour that has begun and not ended.

    Attributes:
        begun_ns: When it began, by `time.monotonic_ns`.
        thread: The identifier of its thread, `None` for a coroutine.
        pace: Of one that hands out intermediate results.
    """

    owner: Owner
    begun_ns: int
    thread: int | None
    coroutine: CoroutineType[Any, Any, Any] | None = None
    pace: Pace | None = None

    @property
    def since_ns(self) -> int:
        """When it began, or went on after an intermediate result."""
        return self.begun_ns if self.pace is None else max(self.begun_ns, self.pace.resumed_ns)

    def format_stack(self) -> str:
        """Return where it is now, innermost call last."""
        if self.coroutine is not None:
            return format_coroutine(self.coroutine)
        return format_thread(self.thread or 0)


# The arguments of a `RunningCall`: to make one takes longer than all other bookkeeping.
_CallEntry: TypeAlias = (
    'tuple[Owner, int, int | None, CoroutineType[Any, Any, Any] | None, Pace | None]'
)


class CallLedger:
    """The behaviours of a node that are running.

    Attributes:
        entries: What runs, by tokens; `None` for what has no stack of its own.
        tokens: What to call the next entry.
        is_awaited: Whether somebody must be told when an entry has gone.
    """

    __slots__ = ('_changed', '_heard_at_end', '_waiters', 'entries', 'is_awaited', 'tokens')

    def __init__(self) -> None:
        self.entries: dict[int, _CallEntry | None] = {}
        self.tokens = itertools.count()
        self.is_awaited = False
        self._waiters = 0
        self._heard_at_end: dict[int, Callable[[], None]] = {}
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
            self.tell_end(token)

    def tell_end(self, token: int) -> None:
        """Tell those who are to know that an entry has gone; wake those who wait for the last."""
        with self._changed:
            hear = self._heard_at_end.pop(token, None)
            self._note_who_awaits()
            if not self.entries:
                self._changed.notify_all()
        if hear is not None:
            hear()

    def hear_end(self, token: int, hear: Callable[[], None]) -> None:
        """Let `hear` be called when an entry has gone."""
        with self._changed:
            self._heard_at_end[token] = hear
            self._note_who_awaits()
        if token not in self.entries:
            # It went before it was seen that somebody is to be told.
            self.tell_end(token)

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
                self._note_who_awaits()

    def _note_who_awaits(self) -> None:
        self.is_awaited = bool(self._waiters or self._heard_at_end)


class BehaviourCall:
    """A function bound to an entity, as a callback for rclpy.

    Args:
        function: Called with the callback's arguments.
        deliver: Takes what the function returned.
        failed: Takes what it raised.
        add_time: Takes how long each call took, in nanoseconds; `None` measures nothing.
        admits: Asked right before the function is called, when the call is in the ledger already:
            whoever closes a gate and then looks into the ledger misses no call. `None` for always.
        pace: Of a function that hands out intermediate results.

    Attributes:
        run: Calls a plain function; returns whether it did not raise.
    """

    __slots__ = (
        '_add_time',
        '_admits',
        '_deliver',
        '_failed',
        '_function',
        '_ledger',
        '_owner',
        '_pace',
        'run',
    )

    def __init__(  # noqa: PLR0913 - all but three have a default or go by their names
        self,
        owner: Owner,
        function: Callable[..., Any],
        ledger: CallLedger,
        *,
        deliver: Callable[[Any], None],
        failed: Callable[[Owner, BaseException], None],
        add_time: Callable[[int], None] | None = None,
        admits: Callable[[], bool] | None = None,
        pace: Pace | None = None,
    ) -> None:
        self._admits = admits
        self._pace = pace
        self._owner = owner
        self._function = function
        self._ledger = ledger
        self._deliver = deliver
        self._failed = failed
        self._add_time = add_time
        self.run: Callable[..., bool] = self._compile()

    def delivering(
        self, deliver: Callable[[Any], None], pace: Pace | None = None
    ) -> BehaviourCall:
        """Return the same call with its result going elsewhere."""
        return BehaviourCall(
            self._owner,
            self._function,
            self._ledger,
            deliver=deliver,
            failed=self._failed,
            add_time=self._add_time,
            admits=self._admits,
            pace=pace,
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
        admits, pace, add_time = self._admits, self._pace, self._add_time
        now_ns, get_thread = monotonic_ns, get_ident

        def call_behaviour(*arguments: Any) -> bool:
            token = next(tokens)
            begun_ns = now_ns()
            entries[token] = (owner, begun_ns, get_thread(), None, pace)
            try:
                if admits is not None and not admits():
                    return False
                result = function(*arguments)
                if forked_children.in_child:
                    end_child()
                deliver(result)
            except BaseException as error:  # noqa: BLE001 - it never takes another node down
                if forked_children.in_child:
                    end_child(error)
                failed(owner, error)
                return False
            finally:
                if add_time is not None:
                    add_time(now_ns() - begun_ns)
                # As `ledger.end` does.
                del entries[token]
                if ledger.is_awaited:
                    ledger.tell_end(token)
            return True

        return call_behaviour

    def _compile_async(self) -> Callable[..., Any]:
        ledger, add_time = self._ledger, self._add_time

        async def await_behaviour(*arguments: Any) -> None:
            begun_ns = monotonic_ns()
            token = None
            try:
                # A wrapper of an async function may itself be a plain one, and raise at once.
                coroutine: CoroutineType[Any, Any, Any] = self._function(*arguments)
                token = next(ledger.tokens)
                ledger.entries[token] = (self._owner, begun_ns, None, coroutine, self._pace)
                if self._admits is not None and not self._admits():
                    coroutine.close()
                    return
                result = await coroutine
                if forked_children.in_child:
                    end_child()
                self._deliver(result)
            except BaseException as error:
                if forked_children.in_child:
                    end_child(error)
                if _comes_from_outside(error):
                    # The executor drops the coroutine; to go on would be an error of Python's.
                    raise
                self._failed(self._owner, error)
            finally:
                if add_time is not None:
                    add_time(monotonic_ns() - begun_ns)
                if token is not None:
                    ledger.end(token)

        # A child goes on in the executor whenever its coroutine waits.
        forked_children.coroutine_codes.add(await_behaviour.__code__)
        return await_behaviour


def _comes_from_outside(error: BaseException) -> bool:
    """Return whether a coroutine is closed, other than by what it awaits itself."""
    trace = error.__traceback__
    return isinstance(error, GeneratorExit) and (trace is None or trace.tb_next is None)
