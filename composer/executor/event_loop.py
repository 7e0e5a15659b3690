"""The leader's loop, and how what it finds is executed: callbacks, coroutines and tasks."""

import weakref
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any, Final

from composer.executor.after_fork import end_child
from composer.executor.deadlines import DelayedCall
from composer.executor.entity_registry import EntityRegistry
from composer.executor.scheduler import Session
from composer.executor.sources.event_source import NOTHING, EventSource, ExecutorParts
from composer.executor.sources.inbox import Inbox
from composer.executor.tasks import (
    ExecutorTask,
    ImmediateCallback,
    ScheduledTask,
    awaited_future,
    tells_at_once,
)
from composer.executor.worker_threads import TAKEOVER_SEC, Worker, WorkerThreads

_RETRY_SEC = 0.001
_MOST_BEFORE_A_RETURN_SEC = 0.0005
_LINGER_SEC = 0.05

# What `CallbackRunner.execute` returns, besides `NOTHING`.
RAN: Final = object()
ENDED: Final = object()
DEFERRED: Final = object()


def weakly(method: Callable[..., Any]) -> Callable[..., None]:
    """Return a function that calls `method` as long as its object is there, and does not keep it.

    A thread with nothing to do keeps neither the executor nor the nodes, which refer to it.
    """
    reference = weakref.WeakMethod(method)

    def call(*arguments: Any) -> None:
        bound = reference()
        if bound is not None:
            bound(*arguments)

    return call


class EventLoop:
    """What the leader does, whichever worker leads: look for events and execute what is ready.

    Args:
        parts: The parts of the executor.
        registry: Compared with the nodes when it is stale.
        runner: Executes what the scheduler started.
        on_error: Receives what the loop itself raised.
        notify: Makes those who spin look again.
        workers: Creates the threads, as `WorkerThreads` does.

    Attributes:
        watchers: Those who want to look again after each callback.
    """

    def __init__(
        self,
        parts: ExecutorParts,
        registry: EntityRegistry,
        runner: 'CallbackRunner',
        on_error: Callable[[BaseException], None],
        notify: Callable[[], None],
        workers: Callable[..., WorkerThreads],
    ) -> None:
        self.workers = workers(weakly(self._lead), weakly(self._on_takeover), on_error)
        self.watchers: set[object] = set()
        self._parts = parts
        self._registry = registry
        self._runner = runner
        self._on_error = on_error
        self._notify = notify
        self._refresh_later: DelayedCall | None = None

    def _lead(self, me: Worker) -> None:
        """Lead until nobody spins, or another worker leads.

        The executor is held except in a wait: it is not finalized while its locks are held.
        """
        executor: Any = None
        try:
            while self._goes_on(me):
                executor = self._parts.executor
                if executor is not None and self._execute_all(me):
                    executor = None
                    self._parts.poller.wait_if(self._is_idle)
                    executor = self._parts.executor
                    if executor is not None and self._is_spinning():
                        self._parts.poller.peek()
                executor = None
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self.workers.stop_leading(me)  # Whoever spins on starts another leader.
            self._on_error(error)
        executor = None
        if self.workers.leader is None:
            self._registry.rest()
        self._notify()

    def _execute_all(self, me: Worker) -> bool:
        """Execute what is ready; returns whether to wait for more."""
        scheduler = self._parts.scheduler
        execute = self._look if scheduler.unlooked else self._execute_ready
        if execute(me) or scheduler.running:
            if not self._is_spinning() or self._parts.poller.peek() or not self._is_idle():
                return False
            if scheduler.running:
                self.workers.let_standby_sleep(me)
        return self.workers.leader is me

    def _goes_on(self, me: Worker) -> bool:
        """Tell whether `me` goes on leading: it waits a little for the next session."""
        if not self._is_spinning() and self.workers.leader is me:
            self.workers.let_standby_sleep(me)
            # What comes meanwhile is taken in rclpy's order when somebody spins again.
            scheduler = self._parts.scheduler
            self._parts.poller.wait_for_wake_if(
                lambda: not scheduler.is_spinning and not scheduler.is_closed, _LINGER_SEC
            )
        return self.workers.is_leader(me, self._is_spinning)

    def _on_takeover(self) -> None:
        if self._parts.scheduler.admitted:
            self._notify()

    def _look(self, me: Worker) -> bool:
        """`_execute_ready` for the sessions that were opened, after a look at everything."""
        scheduler = self._parts.scheduler
        sessions = tuple(scheduler.unlooked)
        admits_one = any(session.admits_one for session in sessions)
        if admits_one:
            self._registry.refresh_if_stale()
            self._runner.resume_paused()
        self._registry.flush()
        if admits_one:
            self._parts.poller.peek()
        while (is_more := self._execute_ready(me)) and any(map(_is_waiting, sessions)):
            pass  # What was ready had nothing to take.
        if self.workers.leader is me:
            scheduler.set_looked(sessions)
            if any(session.is_late for session in sessions):
                self._notify()
        return is_more

    def _execute_ready(self, me: Worker) -> bool:
        """Execute what is ready, and then for a moment what comes meanwhile.

        Every message passes here: to go back to `_lead` for each would cost half as much as the
        middleware does.

        Returns:
            False if there is no more, or `me` was replaced.
        """
        scheduler, peek, execute = self._parts.scheduler, self._parts.poller.peek, self._execute
        left, ended = scheduler.count_ready(), None
        until = monotonic() + _MOST_BEFORE_A_RETURN_SEC
        try:
            while True:
                if self._registry.is_stale:
                    self._refresh()
                work = scheduler.start_next(me, ended)
                ended = None
                if work is None:
                    return False
                ended, now = execute(me, work)
                if self.workers.leader is not me:
                    return False
                left -= 1
                if now > until and left <= 0:
                    return True
                if scheduler.is_spinning and scheduler.is_empty():
                    peek()
        finally:
            if ended is not None:
                scheduler.finish(ended)
            if self.workers.leader is not me and not scheduler.is_empty():
                self._parts.poller.wake()

    def _execute(self, me: Worker, work: Any) -> tuple[Any, float]:
        """Execute what was started.

        Returns:
            What the scheduler must still be told the end of, and the time (monotonic).
        """
        workers = self.workers
        me.busy_since = now = monotonic()
        if now > workers.put_off_at:
            workers.put_off(now)
        if work.slow:
            workers.hand_over(me)
            # That it waited makes it no slow one again.
            me.busy_since = monotonic()
        if me.session is not None and workers.is_alone():
            self._notify()  # Nobody will take over.
        runner = self._runner
        is_task = type(work) is ScheduledTask
        outcome = runner.execute_task(work) if is_task else runner.execute(work)
        now = monotonic()
        work.slow = now - me.busy_since > TAKEOVER_SEC
        me.busy_since = 0.0
        ended = work if outcome is RAN or outcome is NOTHING else None
        if me.session is not None or self.watchers:
            if ended is not None:
                self._parts.scheduler.finish(ended)
            self._finish_session(me, has_run=outcome is RAN or outcome is ENDED)
            return None, now
        return ended, now

    def execute_at_once(self, inbox: Inbox, item: Any) -> bool:
        """See `ComposerExecutor.execute_at_once`."""
        source, scheduler = inbox.source, self._parts.scheduler
        if source is None or source.slow or not self.workers.is_in_callback():
            return False
        if not scheduler.start_idle(source):
            return False
        begun = monotonic()
        inbox.messages.append(item)
        outcome = self._runner.execute(source)
        source.slow = monotonic() - begun > TAKEOVER_SEC
        if outcome is RAN or outcome is NOTHING:
            scheduler.finish(source)
        if not scheduler.is_empty():
            self._parts.poller.wake()  # For what came meanwhile.
        return True

    def _finish_session(self, me: Worker, *, has_run: bool) -> None:
        session, me.session = me.session, None
        if session is not None:
            self._parts.scheduler.finish_session(session, has_run=has_run)
        self._notify()

    def _refresh(self) -> None:
        rest_sec = self._registry.rest_sec()
        if not rest_sec:
            self._registry.refresh()
        elif self._refresh_later is None:
            self._refresh_later = DelayedCall(self._parts.deadlines, rest_sec, self._end_rest)

    def _end_rest(self) -> None:
        self._refresh_later = None

    def _is_idle(self) -> bool:
        return not (
            (self._registry.is_stale and self._refresh_later is None)
            or self._parts.deadlines.jumped
            or self._parts.scheduler.unlooked
            or not self._parts.scheduler.is_spinning
            or self._parts.scheduler.has_work()
        )

    def _is_spinning(self) -> bool:
        return self._parts.scheduler.is_spinning


def _is_waiting(session: Session) -> bool:
    return session.admits_one and session.work is None


class CallbackRunner:
    """Executes what the scheduler started, and resumes what was suspended."""

    def __init__(self, parts: ExecutorParts) -> None:
        self._parts = parts
        self._has_own_rules = parts.executor.has_own_rules
        self._scheduler = parts.scheduler
        self._deadlines = parts.deadlines
        self._paused: set[ScheduledTask] = set()

    def resume_paused(self) -> None:
        """Resume at once the tasks that await nothing known."""
        for task in tuple(self._paused):
            self._resume(task)

    def execute(self, source: EventSource) -> object:
        """Execute a source.

        Returns:
            `RAN` or `NOTHING` if the scheduler must still be told that it has ended; otherwise
            `ENDED`, or `DEFERRED` if it has not run.
        """
        begun = suspended = False
        outcome: Any = NOTHING
        try:
            begun = self._may_begin(source)
            if begun:
                outcome = source.run()
                if outcome is not None and outcome is not NOTHING:
                    suspended = self._begin(outcome, source)
                elif self._parts.is_forked:
                    end_child()
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            outcome = None
            self._report(error)
        finally:
            if begun and not suspended:
                self._end_execution(source)
        if outcome is NOTHING:
            return NOTHING if begun else self._defer(source)
        if suspended:
            self._scheduler.finish(source, suspended=True)
            return ENDED
        return RAN

    def _may_begin(self, source: EventSource) -> bool:
        """Ask the executor's own rules, then the group, which holds the entity from then on."""
        entity = source.entity
        group = entity.callback_group
        if self._has_own_rules and not self._parts.executor.can_execute(entity):
            return False
        if not source.group.is_plain:
            return bool(group.beginning_execution(entity))
        # As its method, whose lock is not needed: CPython switches threads only at calls and
        # jumps back.
        if group._active_entity is not None:  # noqa: SLF001
            return False
        group._active_entity = entity  # noqa: SLF001
        return True

    @staticmethod
    def _end_execution(source: EventSource) -> None:
        entity = source.entity
        if source.group.is_plain:
            entity.callback_group._active_entity = None  # noqa: SLF001
        elif not source.group.unrestricted:
            entity.callback_group.ending_execution(entity)

    def _defer(self, source: EventSource) -> object:
        """Try again: the group is held by another executor, or has rules of its own.

        One that refuses for long sets `wakes_executor`, and then wakes the executor itself.
        """
        self._scheduler.defer(source)
        group = source.entity.callback_group
        if not getattr(group, 'wakes_executor', False):
            DelayedCall(self._deadlines, _RETRY_SEC, self._scheduler.retry_deferred)
        elif group.can_execute(source.entity):
            # It changed its mind before the source was deferred.
            self._scheduler.retry_deferred()
        return DEFERRED

    def _begin(self, coroutine: Any, source: EventSource) -> bool:
        """Run `coroutine` up to its first suspension; returns True if there is one."""
        try:
            coroutine.send(None)
        except StopIteration:
            has_ended = True
        else:
            has_ended = False
        if self._parts.is_forked:
            end_child()
        if has_ended:
            return False
        self._suspend(
            ScheduledTask(ExecutorTask(coroutine, executor=self._parts.executor), source)
        )
        return True

    def execute_task(self, scheduled: ScheduledTask) -> object:
        """Execute a task; returns `ENDED`."""
        task = scheduled.task
        suspended = False
        try:
            task()
            suspended = not (task.done() or task.cancelled())
            error = None if suspended else task.exception()
            if error is not None:
                self._report(error)
            elif self._parts.is_forked:
                end_child()
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self._report(error)
        finally:
            if suspended:
                self._suspend(scheduled)
            elif scheduled.source is not None:
                self._end_execution(scheduled.source)
            self._scheduler.finish(scheduled.source, suspended=suspended)
        return ENDED

    def _report(self, error: BaseException) -> None:
        if self._parts.is_forked:
            end_child(error)
        self._parts.executor.report(error)

    def _suspend(self, task: ScheduledTask) -> None:
        future = awaited_future(task.task)
        if future is not None and tells_at_once(future):
            future.add_done_callback(ImmediateCallback(lambda: self._scheduler.add_task(task)))
            return
        pause_sec = task.next_pause()
        if not pause_sec:
            self._scheduler.add_task(task)
            return
        self._paused.add(task)
        DelayedCall(self._deadlines, pause_sec, lambda: self._resume(task))

    def _resume(self, task: ScheduledTask) -> None:
        with suppress(KeyError):
            self._paused.remove(task)
            self._scheduler.add_task(task)
