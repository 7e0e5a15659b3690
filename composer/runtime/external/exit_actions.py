"""What a process's `on_exit` says: done when the process has ended and is not started again."""

from __future__ import annotations

import threading
from functools import partial
from operator import index
from typing import TYPE_CHECKING

from rclpy.logging import get_logger

from composer.errors import StartError
from composer.runtime.behaviours.calls import BehaviourCall, discard_result
from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.running_calls import Owner, RunningCalls
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.impl.rcutils_logger import RcutilsLogger

    from composer.language.specs import BehaviourSpec
    from composer.processes.external_process import ExternalProcess
    from composer.processes.supervisor import ProcessSupervisor
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.runtime.start import Starter

_POLL_SEC = 0.05


class Process:
    """An external process that has ended, as the behaviours of its `on_exit` see it.

    Attributes:
        name: Its name in the file.
    """

    __slots__ = ('_shutdown', 'name')

    def __init__(self, name: str, shutdown: Callable[[int], None]) -> None:
        self.name = name
        self._shutdown = shutdown

    @property
    def logger(self) -> RcutilsLogger:
        """A ROS logger of its name."""
        return get_logger(self.name)

    def shutdown(self, code: int = 0) -> None:
        """Stop the whole system, after this behaviour has returned, with an exit code."""
        self._shutdown(index(code))


class ExitActions:
    """Does what is due when processes have ended.

    Attributes:
        running: The calls of behaviours that have not ended.
    """

    def __init__(
        self, processes: ProcessSupervisor, starter: Starter, system: SystemHandle
    ) -> None:
        self.running = RunningCalls()
        self._processes = processes
        self._starter = starter
        self._system = system
        self._errors = ErrorReporter(system_logger.error)
        self._lock = threading.Lock()
        self._starting: set[str] = set()

    def act(self, process: ExternalProcess, code: int) -> None:
        """Do all that the `on_exit` of a process says, in order.

        Args:
            code: The exit code, or a signal's number, negative.
        """
        for action in process.spec.on_exit:
            if self._system.stop.is_set or process.is_leaving:
                return
            if action.behaviour is not None:
                self._call(process, action.behaviour, code)
            elif action.start is not None:
                self._start(action.start)
            else:
                self._processes.end_system(code)

    def report_hanging(self) -> bool:
        """Log the behaviours that have not ended; return whether all have."""
        for call in self.running.calls():
            system_logger.error(
                f'{call.owner} did not end in time; it is at\n{call.format_stack()}'
            )
        return self.running.wait_until_idle(0.0)

    def _call(self, process: ExternalProcess, behaviour: BehaviourSpec, code: int) -> None:
        def report(owner: Owner, error: BaseException) -> None:
            place = self._system.positions.value(behaviour.path).place
            self._errors.report(f'{owner} ({place})', error)

        name, functions = process.spec.name, self._system.functions
        function = partial(functions[behaviour.name], **behaviour.arguments)
        owner = Owner('on_exit of process', name)
        call = BehaviourCall(owner, function, self.running, deliver=discard_result, failed=report)
        seen = Process(name, self._system.shutdown)
        if not call.is_async:
            call.run(seen, code)
            return
        ended = threading.Event()
        task = self._system.executor.create_task(call.run, seen, code)
        task.add_done_callback(lambda _task: ended.set())
        while not (ended.wait(_POLL_SEC) or self._system.stop.is_set):
            pass

    def _start(self, name: str) -> None:
        process = self._processes.by_name.get(name)
        with self._lock:
            if process is None or name in self._starting:
                return
            if process.has_come_to('running'):
                system_logger.info(f"process '{name}' runs already, and is not started")
                return
            self._starting.add(name)
        process.restarts = 0
        try:
            self._starter.start_on_demand(process)
        except StartError as error:
            self._processes.end_for_good(process, 1, str(error))
        finally:
            self._starting.discard(name)
