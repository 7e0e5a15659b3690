"""Foreign processes: started, heard, watched, started again, and ended with the system.

Composer starts none of them itself, but the guardian, so that none outlives the system.
"""

from __future__ import annotations

import itertools
import os
import signal
import sys
import tempfile
import threading
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import ExitCode, StartError
from composer.processes.guardian_client import GuardianConnection
from composer.processes.live_process import (
    LiveProcess,
    ProcessRun,
    describe_end,
    describe_limit,
    is_restarted,
    next_delay_sec,
)
from composer.processes.process_commands import CommandWriter, find_folder
from composer.processes.process_output import ProcessOutputs
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from composer.language.specs import ProcessSpec

_LAST_WORDS_SEC = 1.0
# What a process gets to be gone after it was killed.
_KILLED_SEC = 2.0
_NO_GUARDIAN = {'kind': 'failed', 'doing': 'guardian'}


class Processes:
    """All processes of a system. Without any, nothing is done.

    Args:
        end_system: Called with an exit code when a required process has ended.
        timeout_sec: What a process gets to end that says nothing else.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: What the command line says of these.
    """

    def __init__(
        self,
        specs: Iterable[ProcessSpec],
        end_system: Callable[[int], None],
        timeout_sec: float,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
    ) -> None:
        self.by_name = {spec.name: LiveProcess(spec) for spec in specs}
        self._end_system = end_system
        self._timeout_sec = timeout_sec
        self._ros_arguments = ros_arguments
        self._log_levels = log_levels
        self._numbers = itertools.count()
        self._runs: dict[int, ProcessRun] = {}
        self._watchers: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._tools: _Tools | None = None

    def start(self, process: LiveProcess) -> None:
        """Start a process; after `stop` nothing happens.

        Raises:
            StartError: Its program is not there, or cannot be run.
        """
        try:
            run = self._launch(process)
        except OSError as error:
            message = f"process '{process.spec.name}' cannot be started: {error}"
            raise StartError(message) from error
        if run is None:
            return
        answer = run.answer.get()
        if answer['kind'] == 'failed':
            self._runs.pop(run.number, None)
            raise _start_error(process.spec, answer)

    def stop(self) -> bool:
        """End all processes, and whatever they have started.

        Returns:
            Whether none had to be killed.
        """
        with self._lock:
            self._stopping.set()
            runs = list(self._runs.values())
        tools = self._tools
        if tools is None:
            return True
        begun = monotonic()
        for run in runs:
            spec = run.process.spec
            number = signal.Signals[spec.stop_signal]
            tools.guardian.stop(run.number, number, self._timeout_of(spec))
        for run in runs:
            patience = self._timeout_of(run.process.spec) + _KILLED_SEC
            run.gone.wait(max(0.0, begun + patience - monotonic()))
        tools.close()
        for watcher in self._watchers:
            watcher.join()
        return not any(run.was_killed for run in runs)

    def abandon(self) -> None:
        """Kill all at once; for a signal handler."""
        if self._tools is not None:
            self._tools.guardian.abandon()

    def _launch(self, process: LiveProcess) -> ProcessRun | None:
        """Ask for a process; return its run, `None` after the stop."""
        spec = process.spec
        environment = {**_surroundings(), **spec.env}
        with self._lock:
            if self._stopping.is_set():
                return None
            if self._tools is None:
                self._tools = _Tools(self._hear, self._lose, self._ros_arguments, self._log_levels)
            tools = self._tools
            command, folder = tools.commands.write(spec, environment), find_folder(spec)
            output, output_end = os.pipe()
            run = ProcessRun(next(self._numbers), process, tools.outputs.add(spec.name, output))
            self._runs[run.number] = run
            tools.guardian.start(run.number, command, environment, folder, output_end)
            os.close(output_end)
            return run

    def _timeout_of(self, spec: ProcessSpec) -> float:
        return self._timeout_sec if spec.stop_timeout_sec is None else spec.stop_timeout_sec

    def _hear(self, answer: dict[str, Any]) -> None:
        """Take an answer of the guardian."""
        run = self._runs.get(answer['number'])
        if run is None:
            return
        kind = answer['kind']
        if kind == 'started':
            run.process.run = run
            run.answer.put(answer)
        elif kind == 'failed':
            run.answer.put(answer)
        elif kind == 'ended':
            run.code = answer['code']
            watcher = threading.Thread(target=self._after, args=(run, answer['code']), daemon=True)
            self._watchers = [each for each in self._watchers if each.is_alive()]
            self._watchers.append(watcher)
            watcher.start()
        elif kind == 'killed':
            self._note_killed(run)
        elif kind == 'gone':
            run.gone.set()
            self._runs.pop(run.number, None)

    def _note_killed(self, run: ProcessRun) -> None:
        spec = run.process.spec
        if spec.stop_signal != 'SIGKILL':
            run.was_killed = True
            system_logger.error(
                f"process '{spec.name}' did not end within {self._timeout_of(spec):g} s of "
                f'{spec.stop_signal}, and is killed'
            )

    def _lose(self) -> None:
        """Go on without the guardian: what it had started was killed with it."""
        if not self._stopping.is_set():
            system_logger.error('the guardian of the processes was killed, and so were they')
            self._end_system(ExitCode.FAILED)
        for run in list(self._runs.values()):
            run.answer.put(_NO_GUARDIAN)
            run.gone.set()

    def _after(self, run: ProcessRun, code: int) -> None:
        """Say that a process has ended, and do what is to be done then."""
        # What it has started may hold its output open for as long as it likes.
        run.heard.wait(_LAST_WORDS_SEC)
        process, name = run.process, run.process.spec.name
        end = f"process '{name}' {describe_end(code)}"
        if self._stopping.is_set():
            asked = (0, -signal.Signals[process.spec.stop_signal])
            _tell(end, is_fault=code not in asked and not run.was_killed)
            return
        if not is_restarted(process, code):
            process.is_done = True
            _tell(end + describe_limit(process, code), is_fault=code != 0)
            if process.spec.required:
                system_logger.error(f"process '{name}' is required: the system ends")
                self._end_system(ExitCode.DONE if code == 0 else ExitCode.FAILED)
            return
        delay_sec = next_delay_sec(process, monotonic() - run.begun)
        _tell(f'{end}; it is started again in {delay_sec:g} s', is_fault=code != 0)
        if not self._stopping.wait(delay_sec):
            self._restart(process)

    def _restart(self, process: LiveProcess) -> None:
        process.restarts += 1
        try:
            self.start(process)
        except StartError as error:
            system_logger.error(str(error))
            process.is_done = True
            if process.spec.required:
                self._end_system(ExitCode.FAILED)


class _Tools:
    """What processes need to run; made for the first of them."""

    def __init__(
        self,
        hear: Callable[[dict[str, Any]], None],
        lose: Callable[[], None],
        ros_arguments: Sequence[str],
        log_levels: Sequence[str],
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix='composer-', ignore_cleanup_errors=True)
        self.commands = CommandWriter(Path(self._folder.name), ros_arguments, log_levels)
        self.outputs = ProcessOutputs()
        self.guardian = GuardianConnection(hear, lose, self._folder.name)

    def close(self) -> None:
        """End all that was started, and remove what was made for it."""
        self.guardian.close()
        self.outputs.close()
        self._folder.cleanup()


def _tell(text: str, *, is_fault: bool) -> None:
    # A logger of rclpy wants one level for each line of code that calls it.
    if is_fault:
        system_logger.error(text)
    else:
        system_logger.info(text)


def _start_error(spec: ProcessSpec, answer: dict[str, Any]) -> StartError:
    program = spec.command[0] if spec.command else spec.executable
    if answer['doing'] == 'guardian':
        reason = 'its guardian was killed'
    elif answer['doing'] == 'folder':
        reason = f"its folder '{spec.cwd}': {os.strerror(answer['errno'])}"
    else:
        reason = f"'{program}': {os.strerror(answer['errno'])}"
    return StartError(f"process '{spec.name}' cannot be started: {reason}")


def _surroundings() -> dict[str, str]:
    """Return the environment of all processes, as it is where Composer's own is activated."""
    # Python keeps what it prints to itself otherwise, until that is much.
    environment = {'PYTHONUNBUFFERED': '1', **os.environ}
    if sys.prefix != sys.base_prefix:
        # The `python3` of a virtual environment has what Composer has, rclpy for one.
        own = str(Path(sys.executable).parent)
        environment['PATH'] = f'{own}{os.pathsep}{environment.get("PATH", os.defpath)}'
    return environment
