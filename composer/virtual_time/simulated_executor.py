"""The executor in virtual time: the same queues and sources, with nothing that is left to chance.

The leader runs all callbacks, one after the other. When one waits, another thread leads; when it
goes on, it does so as soon as the leader waits, too. Deadlines are those of the virtual clock, and
what the middleware has is looked for when nothing else is ready.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from rclpy.event_handler import QoSPublisherEventType, QoSSubscriptionEventType

from composer.executor.deadlines import Deadlines
from composer.executor.descriptors import TimerFd
from composer.executor.event_poller import EventPoller
from composer.executor.scheduler import Scheduler
from composer.executor.sources.entity_sources import TimerSource
from composer.executor.sources.event_source import ExecutorParts
from composer.executor.sources.qos_events import QosEvent, QosEventPoll
from composer.executor.spinner import Spinner
from composer.executor.wait_set_thread import WaitSetThread
from composer.executor.worker_threads import WorkerThreads
from composer.runtime.system_executor import SystemExecutor
from composer.virtual_time.clocks import MONOTONIC_START_NS, to_ns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.executor.deadlines import Timed
    from composer.executor.scheduler import QueuedSource
    from composer.executor.sources.waitable_sources import WaitSetSource
    from composer.executor.worker_threads import Worker
    from composer.virtual_time.simulated_threads import SimulatedThreads

_HALF: Final = 0.5
_IN_REAL_TIME: Final = (
    QoSPublisherEventType.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
    QoSPublisherEventType.RCL_PUBLISHER_LIVELINESS_LOST,
    QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,
    QoSSubscriptionEventType.RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
)


class SimulatedExecutor(SystemExecutor):
    """Runs callbacks in virtual time; see `SystemExecutor` for the arguments."""

    runs_in_real_time = False

    def __init__(
        self, threads: SimulatedThreads, context: Any, limit: int | None, **calls: Any
    ) -> None:
        self._threads = threads
        super().__init__(context, limit, **calls)
        # In the order in which they came.
        self._nodes: Any = _OrderedSet()

    def halt(self) -> None:
        """Wait for nothing when the interpreter ends: virtual time has ended before."""
        self._is_shutdown = self._is_ended = True

    def observe(self, node: Any, entity: Any, observer: Any) -> None:
        """Do nothing: in virtual time nothing is late or missed."""

    def _create_spinner(self, max_running: int) -> Spinner:
        threads = self._threads
        wait_set = _WaitSet(self._guard, self._sigint_gc, self.context)
        poller = _Poller(threads, wait_set.look)

        def scheduler(*arguments: Any) -> Scheduler:
            return (
                _ShuffledScheduler(threads, *arguments)
                if threads.shuffle
                else Scheduler(*arguments)
            )

        def workers(*arguments: Any) -> WorkerThreads:
            return _Workers(threads, *arguments)

        parts = ExecutorParts(self, max_running, poller, scheduler)
        parts.qos_event_poll = _NoPoll(parts.deadlines, parts.readiness, parts.event_fds.lock)
        return Spinner(parts, wait_set, workers)


class _OrderedSet(dict[Any, None]):
    """A set as far as the executor needs one."""

    def add(self, item: Any) -> None:
        self[item] = None

    def remove(self, item: Any) -> None:
        del self[item]


class _Timer(TimerFd):
    """Calls a function at a virtual time; its descriptor is never readable."""

    def __init__(self, threads: SimulatedThreads, function: Callable[[], None]) -> None:
        super().__init__(blocking=False)
        self._threads = threads
        self._function = function
        self._call: Any = None

    def expire_at(self, deadline_ns: int) -> None:
        self.disarm()
        time_ns = deadline_ns - MONOTONIC_START_NS
        self._call = self._threads.call_at(time_ns, self._function)

    def disarm(self) -> None:
        if self._call is not None:
            self._threads.cancel(self._call)

    def read(self) -> None:
        """Do nothing: whoever calls it knows that it has expired."""


class _Deadlines(Deadlines):
    """Deadlines in virtual time; what is due at the same time comes as it was declared."""

    def __init__(self, threads: SimulatedThreads, wake: Callable[[], None]) -> None:
        self._threads = threads
        self._ranks: dict[TimerSource, int] = {}
        super().__init__(wake)

    def _create_timer(self) -> TimerFd:
        return _Timer(self._threads, self.run_due)

    def _number(self, timed: Timed) -> Any:
        number = next(self._numbers)
        if type(timed) is not TimerSource:
            return number, number
        return self._ranks.setdefault(timed, number), number

    def follow(self, _clock: Any, _follower: Any) -> None:
        """Follow no clock: all of them show virtual time, as the deadlines do."""


class _Poller(EventPoller):
    """Looks for events when nobody has anything to do.

    Args:
        look_elsewhere: Looks for what the poller does not see.
    """

    def __init__(self, threads: SimulatedThreads, look_elsewhere: Callable[[], None]) -> None:
        self._threads = threads
        self._look_elsewhere = look_elsewhere
        super().__init__(lambda wake: _Deadlines(threads, wake))

    def wake(self) -> None:
        """Do nothing: who waits looks by itself."""

    def wait_if(self, is_idle: Callable[[], bool]) -> None:
        """Wait until there is something to do."""

        def has_work() -> bool:
            self.peek()
            self._look_elsewhere()
            return not is_idle()

        self._threads.wait_until(has_work)

    def wait_for_wake_if(self, is_idle: Callable[[], bool], timeout_sec: float) -> None:
        """Wait until there is something to do, or so much virtual time has passed."""
        self._threads.wait_until(lambda: not is_idle(), to_ns(timeout_sec))

    def _check(self) -> None:
        self._next_check = float('inf')


class _NoPoll(QosEventPoll):
    """Asks for no QoS events, which come from threads of the middleware, in real time."""

    def add(self, event: QosEvent) -> None:
        """Do nothing."""


class _WaitSet(WaitSetThread):
    """Looks for what only a wait set sees, without a thread.

    QoS events that threads of the middleware bring, in real time, are left out.
    """

    def add(self, source: WaitSetSource) -> None:
        """See the base class."""
        if getattr(source.entity, 'event_type', None) not in _IN_REAL_TIME:
            super().add(source)

    def add_user(self, user: object) -> None:
        """Do nothing: there is no thread."""

    def remove_user(self, user: object) -> None:
        """Do nothing: there is no thread."""

    def look(self) -> None:
        """Queue what is ready."""
        if self._waited_for:
            self._wait(0)

    def flush(self) -> None:
        """See the base class."""
        self.look()


class _Workers(WorkerThreads):
    """Threads that take turns: one leads, the others wait in callbacks or have nothing to do.

    Nobody stands by: a leader that waits in a callback hands over by itself.
    """

    def __init__(self, threads: SimulatedThreads, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._threads = threads
        self.put_off_at = float('inf')

    @contextmanager
    def registered(self, worker: Worker) -> Iterator[None]:
        """See the base class; when the worker is about to wait, another one leads."""
        thread = self._threads.mine()
        if thread is not None:
            thread.on_wait = lambda: self._replace(worker)
        with super().registered(worker):
            yield

    def start(self) -> None:
        """Make sure that there is a leader."""
        if self.leader is None and not self._ending:
            self.leader = self._give(self._lead)

    def is_alone(self) -> bool:
        """Tell that a leader is replaced where it must be."""
        return False

    def hand_over(self, worker: Worker) -> None:
        """Do nothing before the worker really waits."""

    def let_standby_sleep(self, worker: Worker) -> None:
        """Do nothing: nobody stands by."""

    def _replace(self, worker: Worker) -> None:
        if self.leader is worker and worker.busy_since and not self._ending:
            self.leader = self._give(self._lead)


class _ShuffledScheduler(Scheduler):
    """Starts what is ready in any order, except that each source keeps its own."""

    def __init__(self, threads: SimulatedThreads, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._threads = threads

    def _next_source(self) -> QueuedSource | None:
        shuffle, ready = self._threads.shuffle, self._ready
        if shuffle is not None and len(ready) > 1:
            ready.rotate(shuffle.randrange(len(ready)))
            self._prefers_tasks = shuffle.random() < _HALF
        return super()._next_source()
