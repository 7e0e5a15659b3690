"""The threads: a leader that runs everything, and followers for when a callback holds it up.

The leader waits for events and runs the callbacks itself, so a short callback costs no thread
switch. A standby sleeps on a kernel timer that the leader sets before a callback. If the leader is
still in that callback when the standby wakes, the standby becomes the leader, and another thread
stands by. While callbacks are short, the leader puts the timer off, because each wake-up of the
standby takes the GIL from it. Before a callback that was slow last time, the standby takes over at
once. Idle threads end by themselves.
"""

import _thread
import math
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import get_ident
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from composer.executor.descriptors import LostDescriptorError, TimerFd

if TYPE_CHECKING:
    from composer.executor.scheduler import Session

TAKEOVER_SEC = 0.001
"""How long a callback of the leader may take before the standby takes over."""

_TAKEOVER_NS = int(TAKEOVER_SEC * 1e9)
_MAX_IDLE_SEC = 2.0
_MAX_IDLE_NS = int(_MAX_IDLE_SEC * 1e9)
_POLL_SEC = 0.0005


class Worker:
    """A thread that does one job after the other.

    Attributes:
        busy_since: When its callback began (monotonic); 0 if it runs none.
        session: The session of its callback, if that admits one callback.
    """

    def __init__(self, threads: 'WorkerThreads', job: Callable[['Worker'], None]) -> None:
        self.busy_since = 0.0
        self.session: Session | None = None
        self.job: Callable[[Worker], None] | None = job
        self.has_job = threading.Lock()
        self.has_job.acquire()
        self._threads = threads
        _thread.start_new_thread(self._work, ())  # Unlike `Thread.start`, it does not wait.

    def _work(self) -> None:
        with self._threads.registered(self):
            _set_up_thread()
            while self.job is not None:
                self.job(self)
                self.job = None
                self._threads.wait_for_job(self)


def _set_up_thread() -> None:
    """Name, trace and profile this thread as a `threading.Thread`, if nothing prevents it."""
    with suppress(BaseException):
        threading.current_thread().name = 'executor-worker'
        if (profile := threading.getprofile()) is not None:
            sys.setprofile(profile)
        if (trace := threading.gettrace()) is not None:
            sys.settrace(trace)
        # Python drops a hook that raises, which it may do here; debuggers' and coverage's do not.
        _call_hooks()


def _call_hooks() -> None:
    """Do nothing: a call runs the hooks."""


class WorkerThreads:
    """The threads of one executor.

    Args:
        lead: The job of the leader.
        on_takeover: Called when a standby becomes the leader, because a callback takes long.
        report: Receives what was thrown into a thread from outside while it had no callback.

    Attributes:
        leader: The worker that leads, or None.
        put_off_at: When the standby's timer must be set at the next callback (monotonic); 0 if it
            is not set.
    """

    def __init__(
        self,
        lead: Callable[[Worker], None],
        on_takeover: Callable[[], None],
        report: Callable[[BaseException], None],
    ) -> None:
        self.lock = threading.RLock()  # A finalizer may end the threads.
        self.leader: Worker | None = None
        self._standby: Worker | None = None
        self._lead = lead
        self._on_takeover = on_takeover
        self._report = report
        self._timer = TimerFd(blocking=True)
        self.put_off_at = 0.0
        self._idle: list[Worker] = []
        self._workers: dict[int, Worker] = {}
        self._count = 0  # With those whose threads are still to begin.
        self._ending = False
        self._on_end: Callable[[], None] | None = None
        self._takeover: threading.Lock | None = None

    @contextmanager
    def registered(self, worker: Worker) -> Iterator[None]:
        """Know `worker`, which is this thread, meanwhile; it ends whatever it raises."""
        ident = get_ident()
        self._workers[ident] = worker
        thrown: BaseException | None = None
        try:
            yield
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            thrown = error
        # Python 3.11 keeps what it knows of such a thread for ever.
        threading._active.pop(ident, None)  # type: ignore[attr-defined]  # noqa: SLF001
        with self.lock:
            del self._workers[ident]
            self._count -= 1
            self._remove(worker)
            is_over = self._ending and not self._count
            if is_over:
                self._timer.close()
        if is_over and self._on_end is not None:
            self._on_end()
        if thrown is not None:
            self._report(thrown)

    def is_in_callback(self) -> bool:
        """Tell whether this is called from a callback that a worker runs."""
        worker = self._workers.get(get_ident())
        return worker is not None and worker.busy_since > 0

    def hand_over_in_callback(self) -> bool:
        """Let the standby lead if this thread leads; returns whether it runs a callback at all."""
        worker = self._workers.get(get_ident())
        if worker is None or not worker.busy_since:
            return False
        self.hand_over(worker)
        return True

    def start(self) -> None:
        """Make sure that there are a leader and a standby.

        Raises:
            RuntimeError: The process may have no more threads.
        """
        if self.leader is not None and self._standby is not None:
            return
        with self.lock:
            if self._ending:
                return
            if self.leader is None:
                self.leader = self._give(self._lead)
            self._ensure_standby()

    def is_leader(self, worker: Worker, is_wanted: Callable[[], bool]) -> bool:
        """Tell whether `worker` goes on leading; if no leader is wanted, nobody leads any more."""
        if self.leader is worker and is_wanted():
            return True
        with self.lock:
            if self.leader is not worker:
                return False
            if is_wanted():
                return True
            self._end_leading(worker)
            return False

    def stop_leading(self, worker: Worker) -> None:
        """Let nobody lead if `worker` does."""
        with self.lock:
            if self.leader is worker:
                self._end_leading(worker)

    def _end_leading(self, worker: Worker) -> None:
        self.leader = None
        worker.busy_since = 0.0
        if self._ending:
            self._wake_standby()
        elif self._standby is not None:
            # It stays for the next leader, but not for long.
            self.put_off_at = 0.0
            self._timer.expire_in(_MAX_IDLE_NS)

    def is_alone(self) -> bool:
        """Tell whether nobody stands by."""
        return self._standby is None

    def put_off(self, now: float) -> None:
        """Have the standby sleep on, because the leader begins a callback `now`."""
        self.put_off_at = now + TAKEOVER_SEC / 2
        self._wake_in(_TAKEOVER_NS)

    def let_standby_sleep(self, worker: Worker) -> None:
        """Disarm the standby's timer: `worker` leads and will wait, and others want the GIL."""
        with self.lock:
            if self.put_off_at and self.leader is worker:
                self.put_off_at = 0.0
                self._timer.disarm()

    def hand_over(self, worker: Worker) -> None:
        """Let the standby lead at once, because what `worker` begins will take long.

        Waits until it does: otherwise it has to wrest the GIL from a computing callback.
        """
        with self.lock:
            if self.leader is not worker:
                return
            self._ensure_standby()
            if self._standby is None:
                return
            self.leader = self._standby
            self._takeover = takeover = threading.Lock()
            takeover.acquire()
            self._wake_standby()
        takeover.acquire(timeout=TAKEOVER_SEC)

    def end(self, timeout_sec: float, on_end: Callable[[], None]) -> None:
        """End the threads that have nothing to do, and wait for that; start none any more.

        Args:
            on_end: Called when all threads have ended, also later.
        """
        with self.lock:
            self._ending = True
            self._on_end = on_end
            for worker in self._idle:
                worker.has_job.release()
            self._idle.clear()
            self._wake_standby()
        deadline = monotonic() + timeout_sec
        mine = int(get_ident() in self._workers)
        while self._count > mine and monotonic() < deadline:
            sleep(_POLL_SEC)
        with self.lock:
            if self._count:
                return
            self._timer.close()
        on_end()

    def leave_to_parent(self) -> None:
        """Close the timer that this process, a forked child, shares with its parent."""
        self._timer.close()

    def has_threads(self) -> bool:
        """Tell whether any thread is left."""
        return bool(self._count)

    def wait_for_job(self, worker: Worker) -> None:
        """Wait for the next job of `worker`; without one, its thread is to end."""
        with self.lock:
            if self._ending:
                return
            self._idle.append(worker)
        if worker.has_job.acquire(timeout=_MAX_IDLE_SEC):
            return
        with self.lock:
            if worker in self._idle:
                self._idle.remove(worker)
                return
        worker.has_job.acquire()

    def _give(self, job: Callable[[Worker], None]) -> Worker:
        """Give `job` to an idle worker or a new one."""
        if self._idle:
            worker = self._idle.pop()
            worker.job = job
            worker.has_job.release()
            return worker
        worker = Worker(self, job)
        self._count += 1
        return worker

    def _remove(self, worker: Worker) -> None:
        """Let nobody wait for what `worker` would do; the next `start` replaces it."""
        if worker in self._idle:
            self._idle.remove(worker)
        if self._standby is worker:
            self._standby = None
        if self.leader is worker:
            self.leader = None

    def _ensure_standby(self) -> None:
        if self._standby is None and not self._ending:
            # A process that has all threads it may have goes on with a leader alone.
            with suppress(RuntimeError):
                self._standby = self._give(self._stand_by)

    def _wake_standby(self) -> None:
        if self._standby is not None:
            self.put_off_at = math.inf
            self._wake_in(1)

    def _wake_in(self, delay_ns: int) -> None:
        """Wake the standby in `delay_ns`; what prevents it ends the spin."""
        try:
            self._timer.expire_in(delay_ns)
        except LostDescriptorError as error:
            self._report(error)

    def _stand_by(self, me: Worker) -> None:
        while True:
            self._timer.read()
            with self.lock:
                self.put_off_at = 0.0
                leader = self.leader
                if leader is None:
                    self._standby = None
                    return
                if leader is me or self._is_late(leader):
                    self.leader = me
                    self._standby = None
                    self._ensure_standby()
                    if self._takeover is not None:
                        self._takeover.release()
                        self._takeover = None
                    break
        self._on_takeover()
        self._lead(me)

    def _is_late(self, leader: Any) -> bool:
        """Tell whether the callback of `leader` takes too long; if not yet, set the timer."""
        since = leader.busy_since
        if not since:
            return False
        left = TAKEOVER_SEC - (monotonic() - since)
        if left <= 0:
            return True
        self.put_off_at = since  # The next callback puts it off.
        self._wake_in(int(left * 1e9))
        return False
