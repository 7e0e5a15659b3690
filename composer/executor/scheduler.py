"""What is ready to run, and who may run at the same time.

A source is queued at most once, so its messages keep their order; a source of a busy group is
parked with the group and comes back, one at a time, when the group is free. Nothing is taken out
of the middleware before it can run: what waits longer than the QoS depth allows is dropped
there.
"""

import threading
from collections import deque
from typing import Any, Protocol
from weakref import WeakKeyDictionary

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup

from composer.executor.event_poller import UNKNOWN


class Group:
    """The state of one callback group in one executor."""

    __slots__ = ('__weakref__', 'active', 'admits_all', 'exclusive', 'parked', 'reentrant')

    def __init__(self, callback_group: Any) -> None:
        self.exclusive = isinstance(callback_group, MutuallyExclusiveCallbackGroup)
        self.reentrant = isinstance(callback_group, ReentrantCallbackGroup)
        # A subclass may have rules of its own.
        self.admits_all = type(callback_group) is ReentrantCallbackGroup
        self.active = False
        self.parked: deque[Source] = deque()


class Source(Protocol):
    """An entity as the schedule sees it."""

    group: Group
    node: Any
    alive: bool
    queued: bool
    pending: int
    stamp: int


class Run(Protocol):
    """A task, or a callback that awaits something."""

    node: Any

    def is_orphan(self) -> bool:
        """Tell whether its node has been destroyed."""


class Schedule:
    """The queues. Every change is made with `lock` held, and nothing is called under it."""

    def __init__(self, most_at_once: int, wake: Any) -> None:
        self.lock = threading.RLock()  # A finalizer may create a task.
        self.executing = 0
        self.waiting = 0
        self.admitting = False
        self.is_closed = False
        self._most_at_once = most_at_once
        self._wake = wake
        self._ready: deque[Source] = deque()
        self._runs: list[Run] = []
        self._new_runs: list[Run] = []
        self._held: list[Run] = []
        self._refused: list[Source] = []
        self._nodes: set[Any] = set()
        self._prefer_runs = True
        self._groups: WeakKeyDictionary[Any, Group] = WeakKeyDictionary()

    def __len__(self) -> int:
        return len(self._ready) + len(self._runs) + len(self._new_runs)

    def count_runs(self) -> int:
        """Return how many tasks could run now."""
        return len(self._runs) + len(self._new_runs)

    def can_admit(self) -> bool:
        """Tell whether one more callback may run."""
        return self.executing - self.waiting < self._most_at_once

    def group_of(self, callback_group: Any) -> Group:
        """Return the state of `callback_group`."""
        with self.lock:
            group = self._groups.get(callback_group)
            if group is None:
                group = self._groups[callback_group] = Group(callback_group)
            return group

    def announce(self, source: Source, count: int) -> None:
        """Add `count` to what `source` has to take."""
        with self.lock:
            source.stamp += 1
            if source.pending < UNKNOWN:
                source.pending += count
            if source.alive and not source.queued:
                source.queued = True
                self._ready.append(source)
        self._wake()

    def announce_once(self, source: Source) -> None:
        """Make `source` ready once, however often this is said before it runs."""
        with self.lock:
            source.stamp += 1
            source.pending = 1
            if source.alive and not source.queued:
                source.queued = True
                self._ready.append(source)
        self._wake()

    def drained(self, source: Source, stamp: int) -> None:
        """Note that `source` had nothing left when its stamp was `stamp`."""
        with self.lock:
            if source.stamp == stamp:
                source.pending = 0

    def add_run(self, run: Run) -> None:
        """Queue a task."""
        with self.lock:
            self._new_runs.append(run)
        self._wake()

    def set_nodes(self, nodes: set[Any]) -> None:
        """Tell which nodes' suspended callbacks may go on."""
        with self.lock:
            self._nodes = set(nodes)
            held, self._held = self._held, []
        # Those that go on no more are let go of, which runs what they do in `finally:`.
        kept = [run for run in held if not run.is_orphan()]
        with self.lock:
            self._new_runs += kept

    def claim(self, *, alone: bool = False) -> Any:
        """Return a source or a run to execute now, or None; `finish` must follow.

        With `alone`, also while nobody spins: for the one callback of `spin_once`.
        """
        with self.lock:
            if self.is_closed or not (alone or self.admitting) or not self.can_admit():
                return None
            if not (self._runs or self._new_runs):
                work: Any = self._next_source()
            elif self._prefer_runs:
                work = self._next_run() or self._next_source()
            else:
                work = self._next_source() or self._next_run()
            if work is not None:
                self.executing += 1
            return work

    def close(self) -> None:
        """Let nothing be claimed any more."""
        with self.lock:
            self.is_closed = True
            self.admitting = False

    def finish(self, source: Source | None, *, suspended: bool = False) -> None:
        """Note that what was claimed has run; `source` frees its group unless it is suspended."""
        with self.lock:
            self.executing -= 1
            if source is not None and not suspended:
                self._release(source)

    def leave_to_parent(self, executing: int) -> None:
        """Begin nothing; of all callbacks under way, only `executing` are in this process."""
        self.is_closed = True
        self.admitting = False
        self.executing = executing
        self.waiting = 0

    def refuse(self, source: Source) -> None:
        """Undo a claim of `source`, whose group would not have it; `retry` brings it back."""
        with self.lock:
            self.executing -= 1
            source.pending += 1
            source.queued = True
            self._refused.append(source)
            group = source.group
            group.active = False
            if group.parked:
                self._ready.append(group.parked.popleft())

    def retry(self) -> None:
        """Have the groups asked again that refused a source."""
        if self._refused:
            with self.lock:
                self._ready += self._refused
                self._refused = []
            self._wake()

    def step_aside(self, number: int) -> None:
        """Count so many more callbacks as waiting: others run in their places."""
        with self.lock:
            self.waiting += number
        self._wake()

    def _release(self, source: Source) -> None:
        group = source.group
        if group.exclusive or not group.reentrant:
            group.active = False
            if source.pending and source.alive:
                group.parked.append(source)
            else:
                source.queued = False
            if group.parked:
                self._ready.append(group.parked.popleft())

    def _next_source(self) -> Source | None:
        while self._ready:
            source = self._ready.popleft()
            group = source.group
            if not source.alive or not source.pending:
                source.queued = False
                if group.parked and not group.active:
                    self._ready.append(group.parked.popleft())
                continue
            if not group.exclusive:
                source.pending -= 1
                if group.reentrant and source.pending:
                    self._ready.append(source)
                elif group.reentrant:
                    source.queued = False
            elif group.active:
                group.parked.append(source)
                continue
            else:
                group.active = True
                source.pending -= 1
            self._prefer_runs = True
            return source
        return None

    def _next_run(self) -> Run | None:
        """Return the newest of the oldest batch, as rclpy's executors do."""
        if not self._runs:
            self._runs, self._new_runs = self._new_runs, []
        while self._runs:
            run = self._runs.pop()
            if run.node is not None and run.node not in self._nodes:
                self._held.append(run)
                continue
            self._prefer_runs = False
            return run
        return None
