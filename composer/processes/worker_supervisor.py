"""The processes of workers: started by the reaper as external ones are, with a channel to each."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ExitCode
from composer.language.specs import DEFAULT_RESTART_DELAY_SEC, ProcessSpec
from composer.processes.channel import Channel
from composer.processes.external_process import ExternalProcess
from composer.processes.guardian import kill_marked
from composer.processes.supervisor import Launch, ProcessSupervisor, Tools

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import WorkerSpec
    from composer.processes.channel import Functions
    from composer.processes.external_process import ProcessRun
    from composer.terminal import EscapingLogger

# A path, as `composer.processes` lies below the runtime.
_PROGRAM = Path(__file__).parents[1] / 'runtime' / 'workers' / 'worker_program.py'


class ConnectedProcess(ExternalProcess):
    """The process of a worker.

    Attributes:
        channel: The connection to its last run; `None` before the first.
        functions: What the worker may call.
        mark: What marks the processes that its behaviours start; 0 for nothing.
    """

    def __init__(self, spec: WorkerSpec, functions: Functions) -> None:
        # It is not started again before it has come up.
        super().__init__(worker_rules(spec, is_up=False))
        self.channel: Channel | None = None
        self.functions = functions
        self.mark = 0


class WorkerSupervisor(ProcessSupervisor):
    """Runs the processes of workers; they share standard output and error with Composer.

    Args:
        logger: The logger of the system.
        end_system: Called with an exit code when the reaper was killed.

    Attributes:
        on_end: Called with each process of a worker that has ended though nobody asked for that.
        variables: Environment variables of all workers, beside those of Composer.
    """

    def __init__(
        self, logger: EscapingLogger, end_system: Callable[[int], None], timeout_sec: float
    ) -> None:
        super().__init__((), logger, end_system, timeout_sec)
        self._noun, self._all = 'worker', 'all workers'
        self.on_end: Callable[[ExternalProcess], None] = lambda _process: None
        self.variables: Mapping[str, str] = {}

    def _prepare(self, process: ExternalProcess, _tools: Tools) -> Launch:
        assert isinstance(process, ConnectedProcess)  # noqa: S101 - it starts no others
        spec = process.spec
        own, other = socket.socketpair()
        process.channel = Channel(own.detach(), f"worker '{spec.name}'", process.functions)
        process.channel.listen()
        output_ended = threading.Event()
        output_ended.set()
        descriptors = [os.dup(1), os.dup(2), other.detach()]
        environment = {**os.environ, **self.variables, **spec.env}
        return Launch(spec.command, environment, None, output_ended, descriptors)

    def _after_end(self, run: ProcessRun, code: int) -> None:
        is_expected = run.process.is_leaving or self._stopping.is_set()
        if not is_expected:
            self.on_end(run.process)
        # One that was told to stop has done so itself, unless it hung.
        self._end_marked(run.process)
        # SIGTERM hurries those that have stopped already.
        if is_expected and (run.is_given_up or code in (ExitCode.DONE, -signal.SIGTERM)):
            return
        super()._after_end(run, code)

    @staticmethod
    def _end_marked(process: ExternalProcess) -> None:
        """Kill what behaviours of a worker have started, which has ended."""
        if isinstance(process, ConnectedProcess) and process.mark:
            mark, process.mark = process.mark, 0
            kill_marked(mark, f"worker '{process.spec.name}'")


def worker_rules(spec: WorkerSpec, *, is_up: bool = True) -> ProcessSpec:
    """Return how the process of a worker is started and kept.

    Args:
        is_up: Whether it has come up; before that it is not started again.
    """
    options = subprocess._args_from_interpreter_flags()  # type: ignore[attr-defined]  # noqa: SLF001 - as multiprocessing does
    return ProcessSpec(
        name=spec.name,
        description=spec.description,
        command=(sys.executable, *options, str(_PROGRAM), spec.name),
        package=None,
        executable=None,
        launch=None,
        arguments=(),
        node_name=None,
        namespace=None,
        parameters={},
        parameter_files=(),
        remap=(),
        log_level=None,
        env=spec.environment,
        cwd=None,
        restart=spec.restart if is_up else 'never',
        restart_delay_sec=spec.restart_delay_sec if is_up else DEFAULT_RESTART_DELAY_SEC,
        most_restarts=spec.most_restarts,
        on_exit=(),
        stop_signal='SIGTERM',
        stop_timeout_sec=None,
        wait_for=(),
        delay_sec=0.0,
        on_demand=False,
        nodes=(),
        declares_all_ends=False,
        lifecycle=None,
        components={},
        external=False,
        host=spec.host,
        path=spec.path,
    )
