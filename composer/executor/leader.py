"""What the leader does: it looks for events and executes what is ready."""

from time import monotonic
from typing import Any

from composer.executor.deadlines import Delay
from composer.executor.worker_threads import PATIENCE_SEC, Worker


class Leader:
    """The leader's loop, whichever worker leads.

    Args:
        engine: The parts of the executor.
    """

    def __init__(self, engine: Any) -> None:
        self._engine = engine
        self._put_off: Delay | None = None

    def lead(self, me: Worker) -> None:
        """Lead until nobody spins, or another worker leads."""
        engine = self._engine
        try:
            while engine.crew.leads(me, self._is_admitting):
                if self._execute_ready(me) or engine.schedule.executing:
                    if engine.polling.peek() or not self._has_nothing():
                        continue
                    if engine.schedule.executing:
                        engine.crew.end_watch(me)
                if engine.crew.leader is me:
                    engine.polling.wait_if(self._has_nothing, None)
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            engine.schedule.admitting = False
            engine.crew.leads(me, self._is_admitting)
            engine.report(error)
        engine.news.tell()

    def _execute_ready(self, me: Worker) -> bool:
        """Execute about what is ready now; False if there is no more, or `me` was replaced."""
        crew, schedule = self._engine.crew, self._engine.schedule
        registry, execute = self._engine.registry, self._engine.execute
        left = len(schedule) or 1
        tasks_follow = True
        while left:
            if registry.is_stale:
                self._refresh()
            work = schedule.claim()
            if work is None:
                return False
            crew.begin(me)
            if work.slow:
                crew.pass_on(me)
            execute(work)
            work.slow = monotonic() - me.busy_since > PATIENCE_SEC
            me.busy_since = 0.0
            if crew.leader is not me:
                return False
            left -= 1
            if not left and tasks_follow:
                # As in rclpy, tasks run before what has come since they were created.
                left = schedule.count_runs()
                tasks_follow = False
        return True

    def _refresh(self) -> None:
        engine = self._engine
        rest_sec = engine.registry.rest_sec()
        if not rest_sec:
            engine.registry.refresh(engine.executor.get_nodes())
        elif self._put_off is None:
            self._put_off = Delay(engine.polling.alarms, rest_sec, self._end_rest)

    def _end_rest(self) -> None:
        self._put_off = None

    def _has_nothing(self) -> bool:
        engine = self._engine
        return not (
            (engine.registry.is_stale and self._put_off is None)
            or engine.polling.alarms.jumped
            or not engine.schedule.admitting
            or (len(engine.schedule) and engine.schedule.can_admit())
        )

    def _is_admitting(self) -> bool:
        return bool(self._engine.schedule.admitting)
