"""The threads: a leader that runs everything, and others for when a callback holds it up.

The leader waits for events and runs the callbacks itself, so that a short callback costs no
thread switch. A standby sleeps on a kernel timer that the leader sets before a callback; if the
leader is still in that callback when it wakes, the standby leads, and another thread stands by.
As long as callbacks are short the leader puts the timer off, for each waking takes the interpreter
from it.
A callback that was slow last time makes the standby lead at once. Spare threads end by themselves.
"""

import _thread
import math
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import get_ident
from time import monotonic, sleep
from typing import Any

from composer.executor.after_fork import end_child
from composer.executor.c_bindings import TimerFd

PATIENCE_SEC = 0.001
_PATIENCE_NS = int(PATIENCE_SEC * 1e9)
_SPARE_SEC = 2.0
_POLL_SEC = 0.0005


class Worker:
    """A thread that does one job after the other."""

    def __init__(self, crew: 'Crew', job: Callable[['Worker'], None]) -> None:
        self.busy_since = 0.0
        self.job: Callable[[Worker], None] | None = job
        self.called = threading.Lock()
        self.called.acquire()
        self._crew = crew
        _thread.start_new_thread(self._work, ())  # Unlike `Thread.start`, it does not wait.

    def _work(self) -> None:
        with self._crew.enlisted(self):
            _introduce_thread()
            while self.job is not None:
                self.job(self)
                if self._crew.is_inherited:
                    end_child()
                self.job = None
                self._crew.rest(self)


def _introduce_thread() -> None:
    """Be named, traced and profiled as a `threading.Thread` is, if nothing stands against it."""
    with suppress(BaseException):
        threading.current_thread().name = 'executor-worker'
        if (profile := threading.getprofile()) is not None:
            sys.setprofile(profile)
        if (trace := threading.gettrace()) is not None:
            sys.settrace(trace)
        # Python drops a hook that raises, which it may do here; debuggers' and coverage's do not.
        _be_called()


def _be_called() -> None:
    """Do nothing."""


class Crew:
    """The threads of one executor.

    Args:
        lead: The job of the leader.
        report: Takes what was thrown into a thread from outside while it had no callback.
    """

    def __init__(
        self, lead: Callable[[Worker], None], report: Callable[[BaseException], None]
    ) -> None:
        self.lock = threading.Lock()
        self.leader: Worker | None = None
        self.is_inherited = False
        self._standby: Worker | None = None
        self._lead = lead
        self._report = report
        self._timer = TimerFd(blocking=True)
        self._armed = False
        self._put_off_at = 0.0
        self._spares: list[Worker] = []
        self._workers: dict[int, Worker] = {}
        self._hired = 0  # With those whose threads are yet to begin.
        self._dismissed = False
        self._handover: threading.Lock | None = None

    @contextmanager
    def enlisted(self, worker: Worker) -> Iterator[None]:
        """Know `worker`, which is the present thread, meanwhile; it ends whatever it raises."""
        ident = get_ident()
        self._workers[ident] = worker
        lost: BaseException | None = None
        try:
            yield
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            lost = error
        # Python 3.11 keeps what it knows of such a thread for ever.
        threading._active.pop(ident, None)  # type: ignore[attr-defined]  # noqa: SLF001
        with self.lock:
            del self._workers[ident]
            self._hired -= 1
            self._strike_off(worker)
        if lost is not None:
            self._report(lost)

    def is_in_callback(self) -> bool:
        """Tell whether this is called from a callback that a worker runs."""
        worker = self._workers.get(get_ident())
        return worker is not None and worker.busy_since > 0

    def step_aside(self) -> bool:
        """Lead no more if the present thread does; returns whether it runs a callback at all."""
        worker = self._workers.get(get_ident())
        if worker is None or not worker.busy_since:
            return False
        self.pass_on(worker)
        return True

    def muster(self) -> None:
        """See that there are a leader and a standby."""
        with self.lock:
            if self._dismissed:
                return
            if self.leader is None:
                self.leader = self._call(self._lead)
            self._appoint_standby()

    def leads(self, worker: Worker, is_wanted: Callable[[], bool]) -> bool:
        """Tell whether `worker` is to lead on; if nobody is wanted, nobody leads from now on."""
        if self.leader is worker and is_wanted():
            return True
        with self.lock:
            if self.leader is not worker:
                return False
            if is_wanted():
                return True
            self.leader = None
            worker.busy_since = 0.0
            self._wake_standby()
            return False

    def dispatch(self, job: Callable[[Worker], None]) -> None:
        """Have some thread do `job`."""
        with self.lock:
            self._call(job)

    def begin(self, worker: Worker) -> None:
        """Note that `worker` begins a callback."""
        worker.busy_since = now = monotonic()
        if not self._armed or now > self._put_off_at:
            self._armed = True
            self._put_off_at = now + PATIENCE_SEC / 2
            self._timer.after_ns(_PATIENCE_NS)

    def end_watch(self, worker: Worker) -> None:
        """Let the standby sleep: `worker` leads and will wait, and others want the interpreter."""
        with self.lock:
            if self._armed and self.leader is worker:
                self._armed = False
                self._timer.disarm()

    def pass_on(self, worker: Worker) -> None:
        """Let the standby lead at once, for what `worker` begins will take long.

        Wait until it does, lest it has to wrest the interpreter from a computing callback.
        """
        with self.lock:
            if self.leader is not worker:
                return
            self._appoint_standby()
            if self._standby is None:
                return
            self.leader = self._standby
            self._handover = handover = threading.Lock()
            handover.acquire()
            self._wake_standby()
        handover.acquire(timeout=PATIENCE_SEC)

    def dismiss(self, timeout_sec: float) -> None:
        """End the threads that have nothing to do, and wait for that; for the end of all use."""
        with self.lock:
            self._dismissed = True
            for spare in self._spares:
                spare.called.release()
            self._spares.clear()
            self._wake_standby()
        deadline = monotonic() + timeout_sec
        mine = int(get_ident() in self._workers)
        while self._hired > mine and monotonic() < deadline:
            sleep(_POLL_SEC)
        with self.lock:
            if not self._hired:
                self._timer.close()

    def leave_to_parent(self) -> None:
        """Be without threads, but for one whose callback forked this process."""
        self.is_inherited = True
        self.leader = self._standby = None
        self._spares.clear()
        mine = get_ident()
        self._workers = {mine: self._workers[mine]} if mine in self._workers else {}
        self._hired = len(self._workers)
        self._timer.leave_to_parent()

    def is_manned(self) -> bool:
        """Tell whether any thread is left."""
        return bool(self._hired)

    def rest(self, worker: Worker) -> None:
        """Wait for the next job; return without one to end the thread."""
        with self.lock:
            if self._dismissed:
                return
            self._spares.append(worker)
        if worker.called.acquire(timeout=_SPARE_SEC):
            return
        with self.lock:
            if worker in self._spares:
                self._spares.remove(worker)
                return
        worker.called.acquire()

    def _call(self, job: Callable[[Worker], None]) -> Worker:
        if self._spares:
            worker = self._spares.pop()
            worker.job = job
            worker.called.release()
            return worker
        worker = Worker(self, job)
        self._hired += 1
        return worker

    def _strike_off(self, worker: Worker) -> None:
        """Let nobody wait for what `worker` would do; whoever spins again musters others."""
        if worker in self._spares:
            self._spares.remove(worker)
        if self._standby is worker:
            self._standby = None
        if self.leader is worker:
            self.leader = None

    def _appoint_standby(self) -> None:
        if self._standby is None and not self._dismissed:
            # A process that has all threads it may have goes on with a leader alone.
            with suppress(RuntimeError):
                self._standby = self._call(self._stand_by)

    def _wake_standby(self) -> None:
        if self._standby is not None:
            self._armed = True
            self._put_off_at = math.inf
            self._timer.after_ns(1)

    def _stand_by(self, me: Worker) -> None:
        while True:
            self._timer.read()
            with self.lock:
                self._armed = False
                leader = self.leader
                if leader is None:
                    self._standby = None
                    return
                if leader is me or self._is_late(leader):
                    self.leader = me
                    self._standby = None
                    self._appoint_standby()
                    if self._handover is not None:
                        self._handover.release()
                        self._handover = None
                    break
        self._lead(me)

    def _is_late(self, leader: Any) -> bool:
        since = leader.busy_since
        if not since:
            return False
        left = PATIENCE_SEC - (monotonic() - since)
        if left <= 0:
            return True
        self._armed = True
        self._timer.after_ns(int(left * 1e9))
        return False
