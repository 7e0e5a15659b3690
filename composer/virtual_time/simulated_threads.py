"""Threads that take turns: one runs until it waits, and time passes only when all wait.

What happens next depends on nothing but what happened before: which thread goes on, what is due,
and what time it is then. The threads are real ones, with real stacks and thread-local data; each
but one is parked on a lock of its own.
"""

from __future__ import annotations

import gc
import heapq
import itertools
import logging
from collections import deque
from contextlib import contextmanager
from functools import partial
from operator import itemgetter
from threading import get_native_id
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from composer.errors import ComposerError, EndedWhileWaitingError
from composer.virtual_time.originals import MOST_LOOKS, REAL
from composer.virtual_time.preemption import Preemption
from composer.virtual_time.simulated_thread import Call, SimulatedThread, Wait
from composer.virtual_time.stuck_threads import StuckWatch, describe_waits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from random import Random

_get_ident = REAL.get_ident
_LOOK_SEC = 0.25
_ON_TIME: Final = 0
_LATE: Final = 1
_MOST_ROUNDS: Final = 1000
# Time passes at each so many looks more than `MOST_LOOKS`. A wait of no length counts as some.
_LOOKS_PER_STEP: Final = 100
_LOOKS_PER_WAIT: Final = 10
_STEP_NS: Final = 1_000_000
# After so many waits, young garbage is collected; after so many of these times, all of it.
_WAITS_PER_COLLECTION: Final = 1000
_COLLECTIONS_PER_FULL_ONE: Final = 20

# When, whether after all else at that time, a number that keeps the order, and what.
_Due: TypeAlias = 'tuple[int, int, int, Wait | Call]'


class WaitingWhilePickingError(ComposerError):
    """A finalizer or a condition waits while the next thread is chosen."""

    def __init__(self) -> None:
        message = 'a finalizer or a condition waits while the simulation chooses the next thread'
        super().__init__(message, help='wait in a behaviour, or in a thread of its own')


class NothingHappensError(ComposerError):
    """All threads wait for something that can never come, as there is no time-out."""

    def __init__(self, places: str | None) -> None:
        message = 'everything waits for something that nobody is going to do'
        super().__init__(message, help=places)


def _refuse(_record: object) -> bool:
    return False


class SimulatedThreads:
    """The threads of a simulation, its clock, and what is due.

    One thread from outside, that of a test, may `enter`; virtual time stands still until then.

    Args:
        shuffle: Chooses among the orders that are possible; `None` for first come, first served.
        limit_sec: How much processor time a thread may use without a wait.

    Attributes:
        now_ns: The virtual time, from 0.
        current: The thread whose turn it is.
        on_advance: Called with the time when it has become that.
        turns: How many turns there have been.
        begin_tracing: Called in each thread that begins, to look at its lines; `None` for nothing.
        by_ident: The threads that wait in virtual time now, by what `threading.get_ident` says;
            also those that have ended: finalizers may run in their last steps.
    """

    def __init__(self, shuffle: Random | None = None, limit_sec: float = 30.0) -> None:
        self.now_ns = 0
        self._read_ns: dict[str, int] = {}
        self.current: SimulatedThread | None = None
        self.on_advance: Callable[[int], None] = lambda _now_ns: None
        self.turns = 0
        self.shuffle = shuffle
        self.by_ident: dict[int, SimulatedThread] = {}
        self._ready: deque[SimulatedThread] = deque()
        self._waits: dict[Wait, None] = {}
        self._due: list[_Due] = []
        self._numbers = itertools.count()
        self._visitor: SimulatedThread | None = None
        self._is_closing = False
        self._waits_begun = 0
        # Of the thread that looks for the next turn now; 0 for nobody.
        self._picking_ident = 0
        self._watch = StuckWatch(limit_sec)
        self.begin_tracing: Callable[[], None] | None = (
            Preemption(shuffle, self.pause).begin if shuffle is not None else None
        )

    def mine(self) -> SimulatedThread | None:
        """Return the thread that calls, if it takes turns and waits in virtual time now.

        Raises:
            RuntimeError: It gives its turn away: what is due then depends on no real clock.
        """
        thread = self.by_ident.get(_get_ident())
        if thread is None and self._picking_ident == _get_ident():
            message = 'what comes next is looked for in real time'
            raise RuntimeError(message)
        return thread

    def read_ns(self, clock: str) -> int:
        """Return what a clock says: a nanosecond more than before if no time has passed.

        Real clocks never say the same twice, and libraries divide by the difference.
        """
        self._read_ns[clock] = now_ns = max(self.now_ns, self._read_ns.get(clock, -1) + 1)
        return now_ns

    def ahead_ns(self, clock: str) -> int:
        """Return how far what a clock has just shown is ahead of what it showed before; 0 or 1."""
        return int(self._read_ns.get(clock, 0) > self.now_ns)

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Let the calling thread take turns meanwhile; the first turn is its."""
        ident = _get_ident()
        if ident in self.by_ident:
            yield
            return
        thread = SimulatedThread()
        thread.ident, thread.native = ident, get_native_id()
        self.by_ident[ident] = self.current = self._visitor = thread
        try:
            yield
        finally:
            del self.by_ident[ident]
            self.current = self._visitor = None

    @contextmanager
    def outside(self) -> Iterator[None]:
        """Let the waits of the calling thread be real ones, and nobody else run meanwhile."""
        ident = _get_ident()
        thread = self.by_ident.pop(ident, None)
        picking_ident, self._picking_ident = self._picking_ident, 0
        try:
            yield
        finally:
            self._picking_ident = picking_ident
            if thread is not None:
                self.by_ident[ident] = thread

    @contextmanager
    def added(self, call: Callable[[], object]) -> Iterator[SimulatedThread]:
        """Give a new thread turns, which `run` makes of a real one that is started meanwhile."""
        thread = SimulatedThread(call)
        self._ready.append(thread)
        try:
            yield thread
        except (RuntimeError, MemoryError):
            # The system can start no more threads: nobody would ever pass this turn on.
            self._ready.remove(thread)
            raise

    def start(self, function: Callable[..., object], *args: object) -> SimulatedThread:
        """Call a function in a new thread, when its turn comes.

        Raises:
            RuntimeError: The system can start no more threads.
        """
        with self.added(partial(function, *args)) as thread:
            REAL.start_new_thread(self.run, (thread,))
        return thread

    def run(self, thread: SimulatedThread) -> None:
        """Make its call when it is the turn of `thread`, which is the calling thread then."""
        REAL.acquire(thread.turn)
        thread.ident, thread.native = _get_ident(), get_native_id()
        self.by_ident[thread.ident] = thread
        try:
            if self.begin_tracing is not None:
                self.begin_tracing()
            if thread.error is None and thread.call is not None:
                thread.call()
        except SystemExit:
            pass
        finally:
            # What only it refers to ends in its turn, too: finalizers may do anything.
            thread.call = None
            thread.is_over = True
            if thread is self.current:
                self._pass_on(self._pick())

    def call_at(self, time_ns: int, function: Callable[[], None]) -> Call:
        """Have a function called at a time, or now if that has passed; it must not wait.

        Returns:
            What `cancel` takes.
        """
        call = Call(function)
        heapq.heappush(self._due, (max(time_ns, self.now_ns), _ON_TIME, next(self._numbers), call))
        return call

    @staticmethod
    def cancel(call: Any) -> None:
        """Do not call it, if that is still to come."""
        call.is_over = True

    def wait_until(
        self,
        attempt: Callable[[], object] | None,
        timeout_ns: int | None = None,
        *,
        is_late: bool = False,
    ) -> bool:
        """Let others run until an attempt succeeds; return whether one has in time.

        Args:
            attempt: Called again and again, by whichever thread waits; it must not wait itself.
                `None` if only time is waited for.
            timeout_ns: `None` for no limit.
            is_late: Whether what else is due at the end of the time comes first.
        """
        me = self.current
        if me is None:
            message = 'a thread that takes no turns waits for those that do'
            raise RuntimeError(message)
        if me.ident != _get_ident():
            # It was given up, or has ended: others go on without it.
            raise SystemExit
        if self._picking_ident:
            raise WaitingWhilePickingError
        self._collect_garbage()
        if self._is_closing and me is not self._visitor and self._must_end(me, timeout_ns):
            raise EndedWhileWaitingError
        if me.on_wait is not None:
            me.on_wait()
        wait = Wait(me, attempt)
        is_long = timeout_ns is None or timeout_ns > 0
        me.looks = 0 if is_long else me.looks + _LOOKS_PER_WAIT
        if me.looks > MOST_LOOKS:
            me.looks, timeout_ns = MOST_LOOKS - _LOOKS_PER_STEP, _STEP_NS
        if timeout_ns is not None:
            until_ns = self.now_ns + max(timeout_ns, 0)
            entry = (until_ns, _LATE if is_late else _ON_TIME, next(self._numbers), wait)
            heapq.heappush(self._due, entry)
        if attempt is not None:
            self._waits[wait] = None
        try:
            self._switch(me)
        finally:
            self._end(wait)
        return wait.has_succeeded

    def _collect_garbage(self) -> None:
        """Collect garbage at times that depend on nothing but the waits until now.

        Python would do it whenever objects are made, also in a thread without a turn and while
        the next one is looked for. A thread of its own does it, as finalizers may wait.
        """
        self._waits_begun += 1
        if self._waits_begun % _WAITS_PER_COLLECTION or self._is_closing or gc.isenabled():
            return
        collections = self._waits_begun // _WAITS_PER_COLLECTION
        self.start(gc.collect, 2 if collections % _COLLECTIONS_PER_FULL_ONE == 0 else 1)

    def sleep(self, duration_ns: int) -> None:
        """Let so much time pass."""
        self.wait_until(None, duration_ns)

    def count_look(self, thread: SimulatedThread) -> None:
        """Count that the calling thread reads a clock: time passes in loops that do nothing else.

        That depends only on what the thread does, so that it is the same in each run.
        """
        thread.looks += 1
        if thread.looks > MOST_LOOKS:
            self.let_time_pass(thread)

    def let_time_pass(self, thread: SimulatedThread) -> None:
        """Wait a little, as the calling thread looks at clocks all the time."""
        if thread is self.current and not self._picking_ident:
            self.sleep(_STEP_NS)
            thread.looks = MOST_LOOKS - _LOOKS_PER_STEP

    def pause(self) -> None:
        """Let others run first, if any can."""
        me = self.current
        # While it is outside, or gives its turn away, nobody else may run.
        if me is None or self.by_ident.get(_get_ident()) is not me or self._picking_ident:
            return
        if me.on_wait is not None:
            me.on_wait()
        self._ready.append(me)
        self._switch(me)

    def close(self) -> None:
        """End all threads that wait, where they wait; for the thread that has entered."""
        self._is_closing = True
        # The threads of its pools log that they end.
        pools = logging.getLogger('concurrent.futures')
        pools.addFilter(_refuse)
        try:
            self._end_all()
            for _ in range(_MOST_ROUNDS):
                self._look()
                if not self._ready:
                    self._end_all()
                if not self._ready:
                    break
                self._let_others_end()
            self._watch.end()
        finally:
            pools.removeFilter(_refuse)

    def _end_all(self) -> None:
        """Have those who wait raise `EndedWhileWaitingError` in their turns."""
        due, self._due = sorted(self._due, key=itemgetter(slice(3))), []
        for wait in (*self._waits, *(entry[-1] for entry in due)):
            if isinstance(wait, Wait) and wait.thread is not self.current:
                self._release(wait)
        for thread in self._ready:
            thread.is_ending = True
            thread.error = EndedWhileWaitingError()

    def _let_others_end(self) -> None:
        me = self.current
        while me is not None and self._ready:
            self._ready.append(me)
            self._switch(me)

    @staticmethod
    def _must_end(me: SimulatedThread, timeout_ns: int | None) -> bool:
        """Tell whether a thread ends instead of a wait, after the end of the simulation.

        One that ends may wait for a lock, as those who have it end, too.
        """
        was_ending, me.is_ending = me.is_ending, True
        return not was_ending or timeout_ns is not None

    def _release(self, wait: Wait) -> None:
        if not wait.is_over:
            self._end(wait)
            self._ready.append(wait.thread)

    def _switch(self, me: SimulatedThread) -> None:
        thread = self._pick()
        if thread is not me:
            self._pass_on(thread)
            self._park(me)
        if me.error is not None:
            error, me.error = me.error, None
            raise error

    def _pass_on(self, thread: SimulatedThread) -> None:
        self.turns += 1
        self.current = thread
        thread.turn.release()

    def _park(self, me: SimulatedThread) -> None:
        """Wait for the turn of `me`; the thread from outside looks whether all goes on."""
        if me is not self._visitor:
            REAL.acquire(me.turn)
            return
        self._watch.begin(self._progress(), self.current)
        while not self._comes_back(me):
            if self._watch.is_stuck(self._progress(), self.current):
                raise self._watch.give_up(self._replace_current(me))

    def _progress(self) -> tuple[int, int]:
        return self.turns, self.now_ns

    def _replace_current(self, me: SimulatedThread) -> SimulatedThread | None:
        before, self.current = self.current, me
        return before

    def _comes_back(self, me: SimulatedThread) -> bool:
        """Return whether it is the turn of the thread from outside, after a short wait."""
        try:
            return bool(REAL.acquire(me.turn, True, _LOOK_SEC))
        except BaseException as error:
            # A signal handler raised it: its turn comes when another thread waits.
            if self.current is me:
                raise
            self._tell(error)
            return False

    def _pick(self) -> SimulatedThread:
        """Return the thread whose turn is next, at a later time if there is none now."""
        self._picking_ident = _get_ident()
        try:
            return self._find()
        finally:
            self._picking_ident = 0

    def _find(self) -> SimulatedThread:
        ready = self._ready
        while True:
            try:
                if not ready or self.shuffle is not None:
                    self._look()
                if not ready:
                    self._advance()
                    continue
            except BaseException as error:  # noqa: BLE001 - this thread may be any
                self._tell(error)
            if self.shuffle is not None:
                ready.rotate(self.shuffle.randrange(len(ready)))
            return ready.popleft()

    def _look(self) -> None:
        """Make ready those whose attempts succeed now."""
        for wait in list(self._waits):
            if wait.attempt is not None and wait.attempt():
                wait.has_succeeded = True
                self._release(wait)

    def _advance(self) -> None:
        """Let time pass until something is due, and do that."""
        due = self._due
        while due and due[0][-1].is_over:
            heapq.heappop(due)
        if not due:
            self._give_up()
            return
        time_ns, rank = due[0][:2]
        if time_ns > self.now_ns:
            self.now_ns = time_ns
            self.on_advance(time_ns)
        now = []
        while due and due[0][0] == time_ns and due[0][1] == rank:
            now.append(heapq.heappop(due)[-1])
        if self.shuffle is not None and len(now) > 1:
            self.shuffle.shuffle(now)
        for what in now:
            if isinstance(what, Wait):
                self._release(what)
            elif not what.is_over:
                what.is_over = True
                what.function()

    def _give_up(self) -> None:
        """Nothing is due, and no attempt succeeds: only the thread from outside can go on."""
        if self._visitor is not None and self._is_closing:
            self._ready.append(self._visitor)
        else:
            self._tell(NothingHappensError(describe_waits(self.by_ident.values())))

    def _tell(self, error: BaseException) -> None:
        """Raise an error where the thread from outside waits."""
        if self._visitor is None:
            raise error
        self._visitor.error = error
        if self._visitor not in self._ready:
            self._ready.append(self._visitor)

    def _end(self, wait: Wait) -> None:
        wait.is_over = True
        self._waits.pop(wait, None)
