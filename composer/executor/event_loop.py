"""How what was claimed is executed: callbacks, coroutines and tasks."""

from contextlib import suppress
from typing import Any

from composer.executor.deadlines import Alarms, Delay
from composer.executor.event_source import NOTHING, Source
from composer.executor.scheduler import Schedule
from composer.executor.tasks import Resume, TaskRun, awaited_future, task_of

_RETRY_SEC = 0.001


class Execution:
    """Executes sources and runs, and sees to it that suspended ones go on."""

    def __init__(self, executor: Any, schedule: Schedule, alarms: Alarms) -> None:
        self._executor = executor
        self._schedule = schedule
        self._alarms = alarms
        self._paused: set[TaskRun] = set()

    def execute(self, work: Any) -> bool:
        """Execute what was claimed; returns False if there was nothing to take."""
        if isinstance(work, Source):
            return self._execute_source(work)
        self._execute_run(work)
        return True

    def resume_paused(self) -> None:
        """Try those again at once that wait for nothing known."""
        for run in tuple(self._paused):
            self._resume(run)

    def _execute_source(self, source: Source) -> bool:
        outcome: Any = NOTHING
        suspended = False
        begun = source.group.admits_all
        try:
            begun = begun or source.entity.callback_group.beginning_execution(source.entity)
            if begun:
                outcome = source.run()
                if outcome is not None and outcome is not NOTHING:
                    suspended = self._begin(outcome, source)
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            outcome = None
            self._executor.report(error)
        finally:
            if begun and not suspended:
                self._release(source)
            if begun or outcome is None:
                self._schedule.finish(source, suspended=suspended)
            else:
                self._put_off(source)
        return outcome is not NOTHING

    def _put_off(self, source: Source) -> None:
        """Try again: the group is held by another executor, or has rules of its own.

        One that refuses for long sets `wakes_executor`, and then wakes the executor itself.
        """
        self._schedule.refuse(source)
        group = source.entity.callback_group
        if not getattr(group, 'wakes_executor', False):
            Delay(self._alarms, _RETRY_SEC, self._schedule.retry)
        elif group.can_execute(source.entity):
            # It changed its mind before this was noted.
            self._schedule.retry()

    def _release(self, source: Source) -> None:
        if not source.group.admits_all:
            source.entity.callback_group.ending_execution(source.entity)

    def _begin(self, coroutine: Any, source: Source) -> bool:
        """Run `coroutine` up to its first wait; returns True if there is one."""
        try:
            coroutine.send(None)
        except StopIteration:
            return False
        self._suspend(TaskRun(task_of(coroutine, self._executor), source))
        return True

    def _execute_run(self, run: TaskRun) -> None:
        task = run.task
        suspended = False
        try:
            task()
            suspended = not (task.done() or task.cancelled())
            error = None if suspended else task.exception()
            if error is not None:
                self._executor.report(error)
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self._executor.report(error)
        finally:
            if suspended:
                self._suspend(run)
            elif run.source is not None:
                self._release(run.source)
            self._schedule.finish(run.source, suspended=suspended)

    def _suspend(self, run: TaskRun) -> None:
        future = awaited_future(run.task)
        if future is not None:
            future.add_done_callback(Resume(lambda: self._schedule.add_run(run)))
            return
        pause_sec = run.next_pause()
        if not pause_sec:
            self._schedule.add_run(run)
            return
        self._paused.add(run)
        Delay(self._alarms, pause_sec, lambda: self._resume(run))

    def _resume(self, run: TaskRun) -> None:
        with suppress(KeyError):
            self._paused.remove(run)
            self._schedule.add_run(run)
