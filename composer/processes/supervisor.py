"""External processes: started with the system, started again as the file says, and ended with it.

The reaper starts them on behalf of Composer: no process outlives the system.
"""

from __future__ import annotations

import itertools
import os
import signal
import threading
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import ExitCode, StartError
from composer.processes.backoff import Backoff
from composer.processes.external_process import ExternalProcess, ProcessRun, describe_end
from composer.processes.reaper_client import ReaperConnection
from composer.programs import base_environment
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from composer.language.specs import ProcessSpec
    from composer.terminal import EscapingLogger

# How long the last output of a process is waited for.
_LAST_OUTPUT_SEC = 1.0
# How long it may take until a killed process is gone.
_KILLED_SEC = 2.0
# How long an end that matters is kept back, to be told after the start.
_LONGEST_START_SEC = 1.0
_NO_REAPER = {'kind': 'failed', 'doing': 'reaper'}


class ProcessSupervisor:
    """Runs all processes of a system.

    Args:
        logger: The logger of the system.
        end_system: Called with an exit code when a required process has ended, or the last of all.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line.

    Attributes:
        by_name: The processes.
        on_run: Called with each run of a process that has begun.
        on_exit: Called with a process and its exit code when it has ended for good.
        on_restart: Called with a process that was started again.
        timeout_sec: How long a process may take to end, unless the file says otherwise for it.
        is_alone: Whether the system has no nodes.
    """

    def __init__(
        self,
        specs: Iterable[ProcessSpec],
        logger: EscapingLogger,
        end_system: Callable[[int], None],
        timeout_sec: float,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
    ) -> None:
        self.by_name = {spec.name: ExternalProcess(spec) for spec in specs}
        self._logger = logger
        self._end_system = end_system
        self.timeout_sec = timeout_sec
        self._ros_arguments = ros_arguments
        self._log_levels = log_levels
        self.is_alone = False
        self.on_run: Callable[[ProcessRun], None] = lambda _run: None
        self.on_exit: Callable[[ExternalProcess, int], None] = lambda _process, _code: None
        self.on_restart: Callable[[ExternalProcess], None] = lambda _process: None
        self._has_started = threading.Event()
        self._numbers = itertools.count()
        self._runs: dict[int, ProcessRun] = {}
        self._watchers: list[threading.Thread] = []
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._tools: Tools | None = None
        self._noun, self._all = 'process', 'all external processes'

    def start(self, process: ExternalProcess) -> None:
        """Start a process; after `stop`, or when it was removed, nothing happens.

        Raises:
            StartError: Its program does not exist, or cannot be run.
        """
        if process.is_leaving or process.spec.external:
            return
        process.is_done = False
        try:
            run = self._launch(process)
        except OSError as error:
            message = f"{self._noun} '{process.spec.name}' cannot be started: {error}"
            raise StartError(message) from error
        if run is None:
            return
        answer = run.answer.get()
        if answer['kind'] == 'failed':
            self._runs.pop(run.number, None)
            raise _start_error(self._noun, process.spec, answer)

    def remove(self, name: str) -> None:
        """End a process, and all that it has started, and forget it."""
        self.end(self.by_name.pop(name))

    def end(self, process: ExternalProcess) -> None:
        """End a process, and all that it has started; it is not started again."""
        process.is_leaving = True
        run, tools = process.run, self._tools
        if run is None or tools is None or run.gone.is_set():
            return
        self._ask_to_end(run, tools)
        run.gone.wait(self._timeout_of(process.spec) + _KILLED_SEC)

    def restart(self, process: ExternalProcess) -> str:
        """End a process, if it runs, and start it; return why that failed, or an empty string.

        Its restarts count anew, as its user may have removed what made it fail.
        """
        run, tools = process.run, self._tools
        if run is not None:
            run.is_replaced = True
            if tools is not None and not run.gone.is_set():
                self._ask_to_end(run, tools)
                if not run.gone.wait(self._timeout_of(process.spec) + _KILLED_SEC):
                    return f"{self._noun} '{process.spec.name}' does not end"
        process.restarts, process.backoff = 0, Backoff(least_sec=process.spec.restart_delay_sec)
        try:
            self.start(process)
        except StartError as error:
            self._logger.error(str(error))
            process.is_done = True
            return str(error)
        self._logger.warning(f"{self._noun} '{process.spec.name}' was restarted")
        self.on_restart(process)
        return ''

    def fail(self, run: ProcessRun) -> None:
        """End a run as one that has failed, if something is to be done about that."""
        spec, tools = run.process.spec, self._tools
        if tools is not None and run.code is None and (spec.restart != 'never' or spec.on_exit):
            run.has_failed = True
            self._ask_to_end(run, tools)

    def kill(self, process: ExternalProcess) -> None:
        """Kill a process, which has failed."""
        run, tools = process.run, self._tools
        if run is not None and tools is not None and run.code is None:
            run.is_given_up = True
            tools.reaper.stop(run.number, signal.SIGKILL, 0.0)

    def tell_ends(self) -> None:
        """Log from now on how processes have ended: the system has started, or never will."""
        self._has_started.set()

    def stop(self) -> bool:
        """End all processes, and all that they have started.

        Returns:
            Whether none had to be killed.
        """
        self.tell_ends()
        with self._lock:
            self._stopping.set()
            runs = list(self._runs.values())
        tools = self._tools
        if tools is None:
            return True
        begun = monotonic()
        for run in runs:
            self._ask_to_end(run, tools)
        for run in runs:
            timeout_sec = self._timeout_of(run.process.spec) + _KILLED_SEC
            run.gone.wait(max(0.0, begun + timeout_sec - monotonic()))
        tools.close()
        for watcher in self._watchers:
            # A behaviour in an `on_exit` may hang.
            watcher.join(max(_KILLED_SEC, begun + self.timeout_sec - monotonic()))
        return not any(run.was_killed for run in runs)

    def kill_all(self) -> None:
        """Kill all processes at once; a signal handler may call it."""
        if self._tools is not None:
            self._tools.reaper.kill_all()

    def _launch(self, process: ExternalProcess) -> ProcessRun | None:
        """Ask the reaper to start a process; return its run, `None` after the stop."""
        with self._lock:
            if self._stopping.is_set():
                return None
            if self._tools is None:
                self._tools = Tools(
                    self._take_answer, self._on_reaper_lost, self._ros_arguments, self._log_levels
                )
            number = next(self._numbers)
            launch = self._prepare(process, self._tools)
            run = self._runs[number] = ProcessRun(number, process, launch.output_ended)
            self._tools.reaper.start(
                number, launch.command, launch.environment, launch.folder, launch.descriptors
            )
            for each in launch.descriptors:
                os.close(each)
            return run

    def _prepare(self, process: ExternalProcess, tools: Tools) -> Launch:
        """Return what a process is started with."""
        from composer.processes.process_commands import find_folder

        spec = process.spec
        environment = {**base_environment(os.environ), **spec.env}
        command, folder = tools.commands.write(spec, environment), find_folder(spec)
        output, output_end = os.pipe()
        ended = tools.outputs.add(spec.name, output)
        return Launch(command, environment, folder, ended, [output_end])

    def _ask_to_end(self, run: ProcessRun, tools: Tools) -> None:
        spec = run.process.spec
        number = signal.Signals[spec.stop_signal]
        # `ros2 launch` ends what it has started, each in its own time.
        is_launch = spec.launch is not None
        tools.reaper.stop(run.number, number, self._timeout_of(spec), alone=is_launch)

    def _timeout_of(self, spec: ProcessSpec) -> float:
        return self.timeout_sec if spec.stop_timeout_sec is None else spec.stop_timeout_sec

    def _take_answer(self, answer: dict[str, Any]) -> None:
        run = self._runs.get(answer['number'])
        if run is None:
            return
        kind = answer['kind']
        if kind == 'started':
            run.process.run = run
            run.pid = answer['pid']
            run.answer.put(answer)
            self.on_run(run)
        elif kind == 'failed':
            run.answer.put(answer)
        elif kind == 'ended':
            # However it has ended then.
            run.code = answer['code'] or (ExitCode.FAILED if run.has_failed else 0)
            run.ended.set()
            watcher = threading.Thread(target=self._after_end, args=(run, run.code), daemon=True)
            self._watchers = [each for each in self._watchers if each.is_alive()]
            self._watchers.append(watcher)
            watcher.start()
        elif kind == 'urged':
            self._report_urged(run, signal.Signals(answer['signal']).name)
        elif kind == 'killed':
            self._report_killed(run)
        elif kind == 'gone':
            run.gone.set()
            self._runs.pop(run.number, None)

    def _report_urged(self, run: ProcessRun, urge: str) -> None:
        spec, limit_sec = run.process.spec, self._timeout_of(run.process.spec) / 2
        if not run.is_given_up:
            self._logger.warning(
                f"{self._noun} '{spec.name}' did not end within {limit_sec:g} s of "
                f'{spec.stop_signal}, and gets {urge}{" again" * (urge == spec.stop_signal)}'
            )

    def _report_killed(self, run: ProcessRun) -> None:
        spec = run.process.spec
        if spec.stop_signal != 'SIGKILL' and not run.is_given_up:
            run.was_killed = True
            self._logger.error(
                f"{self._noun} '{spec.name}' did not end within {self._timeout_of(spec):g} s of "
                f'{spec.stop_signal}, and is killed'
            )

    def _on_reaper_lost(self) -> None:
        # All that it had started was killed with it.
        for run in list(self._runs.values()):
            run.code = -signal.SIGKILL if run.code is None else run.code
            run.ended.set()
        if not self._stopping.is_set():
            self._logger.error(f'the process reaper was killed, and {self._all} with it')
            self._end_system(ExitCode.FAILED)
        for run in list(self._runs.values()):
            run.answer.put(_NO_REAPER)
            run.gone.set()

    def _after_end(self, run: ProcessRun, code: int) -> None:
        """Log that a process has ended, and start it again or end the system if that is due."""
        # Children of the process may hold its output open for longer.
        run.output_ended.wait(_LAST_OUTPUT_SEC)
        process, name = run.process, run.process.spec.name
        end = f"{self._noun} '{name}' {describe_end(code)}"
        if self._stopping.is_set() or process.is_leaving or run.is_replaced:
            expected = (0, -signal.Signals[process.spec.stop_signal], -signal.SIGTERM)
            self._log(end, is_error=code not in expected and not run.was_killed)
            return
        if not process.is_restarted(code):
            self.end_for_good(process, code, end + process.describe_limit(code))
            return
        delay_sec = process.backoff.next_delay_sec()
        self._has_started.wait(_LONGEST_START_SEC)
        self._log(f'{end}; it is started again in {delay_sec:g} s', is_error=code != 0)
        if not (self._stopping.wait(delay_sec) or process.is_leaving or run.is_replaced):
            self._restart(process)

    def _restart(self, process: ExternalProcess) -> None:
        process.restarts += 1
        run, tools = process.run, self._tools
        if process.spec.launch is not None and run is not None and tools is not None:
            # If `ros2 launch` was killed, what it had started is still there.
            self._ask_to_end(run, tools)
            run.gone.wait(self._timeout_of(process.spec) + _KILLED_SEC)
        try:
            self.start(process)
        except StartError as error:
            self.end_for_good(process, ExitCode.FAILED, str(error))
            return
        self.on_restart(process)

    def end_for_good(self, process: ExternalProcess, code: int, end: str) -> None:
        """Log how a process has ended, and do what is due then.

        Args:
            code: The exit code, or a signal's number, negative.
            end: How it has ended, in words.
        """
        process.is_acting = True
        process.is_done = True
        if not process.spec.on_exit:
            self._has_started.wait(_LONGEST_START_SEC if code != 0 else None)
        if any(each.ends_system for each in process.spec.on_exit):
            end += ', so the system ends'
        self._log(end, is_error=code != 0)
        self.on_exit(process, code)
        process.is_acting = False
        self._end_if_last()

    def end_system(self, code: int) -> None:
        """End the system, because a process has ended."""
        self._has_started.wait(_LONGEST_START_SEC)
        self._end_system(ExitCode.DONE if code == 0 else ExitCode.FAILED)

    def _end_if_last(self) -> None:
        """End a system without nodes whose processes have all ended."""
        self._has_started.wait()
        processes = self.by_name.values()
        if self.is_alone and all(each.is_over for each in processes):
            self._logger.info('all processes have ended: the system ends')
            have_succeeded = all(each.has_succeeded for each in processes if each.is_done)
            self._end_system(ExitCode.DONE if have_succeeded else ExitCode.FAILED)

    def _log(self, text: str, *, is_error: bool) -> None:
        if is_error:
            self._logger.error(text)
        else:
            self._logger.info(text)


@record
class Launch:
    """What a process is started with.

    Attributes:
        folder: The folder it runs in; `None` for that of Composer.
        output_ended: Set when no process holds its output open any more.
        descriptors: See `ReaperConnection.start`; closed once it has them.
    """

    command: Sequence[str]
    environment: Mapping[str, str]
    folder: str | None
    output_ended: threading.Event
    descriptors: Sequence[int]


class Tools:
    """What external processes need; created for the first of them."""

    def __init__(
        self,
        take_answer: Callable[[dict[str, Any]], None],
        on_lost: Callable[[], None],
        ros_arguments: Sequence[str],
        log_levels: Sequence[str],
    ) -> None:
        # A worker has no processes, and starts faster without these.
        from composer.processes.process_commands import CommandWriter
        from composer.processes.process_folder import ProcessFolder
        from composer.processes.process_output import ProcessOutputs

        self._folder = ProcessFolder()
        self.commands = CommandWriter(self._folder.path, ros_arguments, log_levels)
        self.outputs = ProcessOutputs()
        self.reaper = ReaperConnection(take_answer, on_lost, str(self._folder.path))

    def close(self) -> None:
        """Kill what is left of the processes, and remove the temporary files."""
        self.reaper.close()
        self.outputs.close()
        self._folder.remove()


def _start_error(noun: str, spec: ProcessSpec, answer: dict[str, Any]) -> StartError:
    program = spec.command[0] if spec.command else spec.executable or 'ros2'
    if answer['doing'] == 'reaper':
        reason = 'the process reaper was killed'
    elif answer['doing'] == 'folder':
        reason = f"its folder '{spec.cwd}': {os.strerror(answer['errno'])}"
    else:
        reason = f"'{program}': {os.strerror(answer['errno'])}"
    return StartError(f"{noun} '{spec.name}' cannot be started: {reason}")
