"""What is ready to run, and which callbacks may run at the same time.

A source is queued at most once, so its messages keep their order. A source whose group is busy is
parked with the group and comes back, one at a time, when the group is free. Nothing is taken out
of the middleware before it can run: what waits longer than the QoS depth allows is dropped there.
"""

import threading
from collections import deque
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import rclpy.timer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup

from composer.executor.event_fds import UNKNOWN_COUNT
from composer.executor.tasks import ScheduledTask

# rclpy 9, which brought `TimerInfo`, executes the oldest task first.
_OLDEST_TASK_FIRST = hasattr(rclpy.timer, 'TimerInfo')


class Group:
    """The state of one callback group in one executor."""

    __slots__ = (
        '__weakref__',
        'active',
        'exclusive',
        'is_plain',
        'parked',
        'reentrant',
        'unrestricted',
    )

    def __init__(self, callback_group: Any) -> None:
        self.exclusive = isinstance(callback_group, MutuallyExclusiveCallbackGroup)
        self.reentrant = isinstance(callback_group, ReentrantCallbackGroup)
        # A subclass may have rules of its own.
        self.unrestricted = type(callback_group) is ReentrantCallbackGroup
        self.is_plain = type(callback_group) is MutuallyExclusiveCallbackGroup
        self.active = False
        self.parked: deque[QueuedSource] = deque()


class Session:
    """A call of `spin` or `spin_once`: callbacks may begin while one is open.

    Args:
        admits_one: Whether one callback may begin by it, not any number.

    Attributes:
        work: What has begun, if it admits one.
        has_ended: Whether that has ended.
        is_closed: Whether nothing begins by it any more.
        is_late: Whether it is closed as soon as it has looked.
        has_looked: Whether what was ready when it was opened has begun, as far as it could.
        error: What it raises when it ends.
    """

    __slots__ = ('admits_one', 'error', 'has_ended', 'has_looked', 'is_closed', 'is_late', 'work')

    def __init__(self, *, admits_one: bool) -> None:
        self.admits_one = admits_one
        self.work: Any = None
        self.error: BaseException | None = None
        self.has_ended = False
        self.is_closed = False
        self.has_looked = False
        self.is_late = False


class Starter(Protocol):
    """A thread that executes what it starts.

    Attributes:
        session: The session of what it executes, if that admits one callback.
    """

    session: Session | None


class QueuedSource(Protocol):
    """An entity as the scheduler sees it.

    Attributes:
        alive: Whether the executor still listens to it.
        queued: Whether it is in a queue, parked or running.
        pending: How many events it still has to take from the middleware.
        local: What has come to it without the middleware, oldest first.
        spends: What a start takes from `pending`: 1; or 0 if the run does, as it may take a
            local one instead.
        revision: Grows with every event, which tells whether one came meanwhile.
    """

    group: Group
    node: Any
    alive: bool
    queued: bool
    pending: int
    local: Sequence[Any]
    spends: int
    revision: int


class Scheduler:
    """The queues of one executor. They change only under `lock`, and nothing is called under it.

    Events are put down without the lock, and added to the queues by whoever holds it next.

    Args:
        max_running: How many callbacks may run at the same time.
        wake: Makes the threads that wait for events look again.
        waiting: These threads.
        has_node: Tells whether the executor has a node, whose suspended callbacks it may resume.

    Attributes:
        running: How many callbacks have begun and not ended.
        waiting: How many of these wait for others, and do not count against `max_running`.
        is_spinning: Whether callbacks may begin, because a session is open that admits them.
        is_closed: Whether nothing begins any more.
        admitted: How many callbacks run of sessions that admit one.
        unlooked: The sessions that have not looked yet.
    """

    def __init__(
        self,
        max_running: int,
        wake: Callable[[], None],
        waiting: Collection[int],
        has_node: Callable[[Any], bool],
    ) -> None:
        self.lock = threading.RLock()  # A finalizer may create a task.
        self.running = 0
        self.waiting = 0
        self.is_spinning = False
        self.admitted = 0
        self.unlooked: list[Session] = []
        self.is_closed = False
        self._unlimited: set[Session] = set()
        self._admitting: deque[Session] = deque()
        self._max_running = max_running
        self._wake = wake
        self._waiting_threads = waiting
        self._has_node = has_node
        self._announced: deque[tuple[QueuedSource, int]] = deque()
        self._ready: deque[QueuedSource] = deque()
        self._tasks: list[ScheduledTask] = []
        self._new_tasks: list[ScheduledTask] = []
        self._tasks_without_node: list[ScheduledTask] = []
        self._deferred: list[QueuedSource] = []
        self._prefers_tasks = True
        self._groups: WeakKeyDictionary[Any, Group] = WeakKeyDictionary()

    def count_ready(self) -> int:
        """Return how many sources and tasks are ready, at least."""
        return len(self._ready) + len(self._tasks) + len(self._new_tasks)

    def is_empty(self) -> bool:
        """Tell whether nothing is ready."""
        return not (self._ready or self._announced or self._tasks or self._new_tasks)

    def has_work(self) -> bool:
        """Tell whether something is ready, and one more callback may run."""
        return not self.is_empty() and self._has_free_slot()

    def limit_running(self, most: int) -> None:
        """Let so many callbacks run at the same time; those beyond that run to their end."""
        with self.lock:
            self._max_running = most
        self._wake()

    def _has_free_slot(self) -> bool:
        return self.running - self.waiting < self._max_running

    def open_session(self, session: Session) -> None:
        """Let callbacks begin by `session`."""
        with self.lock:
            if self.is_closed:
                return
            if session.admits_one:
                self._admitting.append(session)
            else:
                self._unlimited.add(session)
            self.unlooked.append(session)
            self.is_spinning = True

    def close_session(self, session: Session) -> None:
        """Let no callback begin by `session` any more."""
        with self.lock:
            session.is_closed = True
            self._unlimited.discard(session)
            for sessions in (self._admitting, self.unlooked):
                if session in sessions:
                    sessions.remove(session)
            self._set_spinning()

    def set_looked(self, sessions: Iterable[Session]) -> None:
        """Note that what was ready has begun, as far as it could."""
        with self.lock:
            for session in sessions:
                session.has_looked = True
            self.unlooked = [session for session in self.unlooked if not session.has_looked]

    def _set_spinning(self) -> None:
        self.is_spinning = not self.is_closed and bool(self._unlimited or self._admitting)

    def group_of(self, callback_group: Any) -> Group:
        """Return the state of `callback_group`."""
        with self.lock:
            group = self._groups.get(callback_group)
            if group is None:
                group = self._groups[callback_group] = Group(callback_group)
            return group

    def add_events(self, source: QueuedSource, count: int) -> None:
        """Add `count` to what `source` has to take; 0 if something local came."""
        self._announced.append((source, count))
        if self._waiting_threads:
            self._wake()

    def _add_announced(self) -> None:
        announced = self._announced
        while announced:
            source, count = announced.popleft()
            source.revision += 1
            if source.pending < UNKNOWN_COUNT:
                source.pending += count
            if source.alive and not source.queued:
                source.queued = True
                self._ready.append(source)

    def set_ready(self, source: QueuedSource) -> None:
        """Make `source` run once, however often this is called before it does."""
        with self.lock:
            self._add_announced()  # They were first.
            source.revision += 1
            source.pending = 1
            if source.alive and not source.queued:
                source.queued = True
                self._ready.append(source)
        self._wake()

    def set_empty(self, source: QueuedSource, revision: int) -> None:
        """Note that `source` had nothing left to take when it was at `revision`."""
        with self.lock:
            self._add_announced()
            if source.revision == revision:
                source.pending = 0

    def spend(self, source: QueuedSource) -> None:
        """Note that `source`, from whose `pending` a start takes nothing, takes one event."""
        with self.lock:
            if source.pending:
                source.pending -= 1

    def add_task(self, task: ScheduledTask) -> None:
        """Queue a task."""
        with self.lock:
            self._new_tasks.append(task)
        self._wake()

    def retry_suspended(self) -> None:
        """Queue the suspended callbacks again whose nodes were not in the executor."""
        with self.lock:
            tasks, self._tasks_without_node = self._tasks_without_node, []
        # Those of destroyed nodes are dropped, which runs their `finally:` blocks.
        kept = [task for task in tasks if not task.is_orphan()]
        with self.lock:
            self._new_tasks += kept

    def start_next(self, starter: Starter, ended: QueuedSource | None = None) -> Any:
        """Return a source or a task that `starter` executes now, or None.

        `finish` must follow, and `finish_session` if this gave the starter a session.

        Args:
            ended: What to `finish` first; to take the lock once for both is faster.
        """
        with self.lock:
            if ended is not None:
                self.running -= 1
                self._release(ended)
            if self._announced:
                self._add_announced()
            if not self.is_spinning or self.running - self.waiting >= self._max_running:
                return None
            if not (self._tasks or self._new_tasks):
                work: Any = self._next_source()
            elif self._prefers_tasks:
                work = self._next_task() or self._next_source()
            else:
                work = self._next_source() or self._next_task()
            if work is not None:
                self.running += 1
                if self._admitting:
                    session = self._admitting.popleft()
                    session.work = work
                    starter.session = session
                    self.admitted += 1
                    self._set_spinning()
            return work

    def start_idle(self, source: QueuedSource) -> bool:
        """Start `source` in a thread that would wait for it; `finish` must follow.

        Returns:
            False if it has something to take already, or nothing may begin for now.
        """
        with self.lock:
            self._add_announced()
            group = source.group
            if source.queued or group.active or not (source.alive and self.is_spinning):
                return False
            if self._admitting or not (group.exclusive or group.reentrant):
                return False
            if group.exclusive:
                group.active = source.queued = True
            self.running += 1
            return True

    def finish(self, source: QueuedSource | None, *, suspended: bool = False) -> None:
        """Note that what was started has run; `source` frees its group unless it is suspended."""
        with self.lock:
            self.running -= 1
            if source is not None and not suspended:
                self._release(source)

    def finish_session(self, session: Session, *, has_run: bool) -> None:
        """Note that the callback of `session` has ended; another may begin if it has not run."""
        with self.lock:
            self.admitted -= 1
            if has_run or self.is_closed or session.is_closed:
                session.has_ended = True
            else:
                session.work = None
                self._admitting.appendleft(session)
                self.is_spinning = True

    def defer(self, source: QueuedSource) -> None:
        """Undo the start of `source`, because its group refused; `retry_deferred` requeues it."""
        with self.lock:
            self.running -= 1
            source.pending += source.spends
            source.queued = True
            if source in self._ready:
                # A reentrant group queues it for its next event when it begins with one.
                self._ready.remove(source)
            if source not in self._deferred:
                self._deferred.append(source)
            group = source.group
            group.active = False
            if group.parked:
                self._ready.append(group.parked.popleft())

    def retry_deferred(self) -> None:
        """Queue the sources again whose groups have refused them."""
        if self._deferred:
            with self.lock:
                self._ready += self._deferred
                self._deferred = []
            self._wake()

    def add_waiting(self, number: int) -> None:
        """Count so many more callbacks as waiting: others run in their places."""
        with self.lock:
            self.waiting += number
            may_begin = number > 0 and not self.is_empty()
        if may_begin:
            self._wake()

    def close(self) -> None:
        """Start nothing any more."""
        with self.lock:
            self.is_closed = True
            self.is_spinning = False

    def _release(self, source: QueuedSource) -> None:
        group = source.group
        if group.exclusive or not group.reentrant:
            group.active = False
            if (source.pending or source.local) and source.alive:
                group.parked.append(source)
            else:
                source.queued = False
            if group.parked:
                self._ready.append(group.parked.popleft())

    def _next_source(self) -> QueuedSource | None:
        while self._ready:
            source = self._ready.popleft()
            group = source.group
            if not source.alive or not (source.pending or source.local):
                source.queued = False
                if group.parked and not group.active:
                    self._ready.append(group.parked.popleft())
                continue
            if not group.exclusive:
                source.pending -= source.spends
                if group.reentrant and (source.pending or source.local):
                    self._ready.append(source)
                elif group.reentrant:
                    source.queued = False
            elif group.active:
                group.parked.append(source)
                continue
            else:
                group.active = True
                source.pending -= source.spends
            self._prefers_tasks = True
            return source
        return None

    def _next_task(self) -> ScheduledTask | None:
        """Return a task of the oldest batch, in the order of this rclpy's executors."""
        if not self._tasks:
            self._tasks, self._new_tasks = self._new_tasks, []
            if _OLDEST_TASK_FIRST:
                self._tasks.reverse()
        while self._tasks:
            task = self._tasks.pop()
            if task.node is not None and not self._has_node(task.node):
                self._tasks_without_node.append(task)
                continue
            self._prefers_tasks = False
            return task
        return None
