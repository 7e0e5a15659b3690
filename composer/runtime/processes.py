"""Foreign processes: started, heard, watched, started again, and ended with the system.

Every process is a session of its own, so that a signal from the terminal reaches Composer alone,
and whoever it starts can be signalled with it. None outlives Composer: the kernel kills the
process itself when the thread that started it dies, and a guardian whatever that has left behind.
"""

from __future__ import annotations

import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import uuid
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.ament import list_executables
from composer.errors import StartError
from composer.runtime import guardian
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from composer.language.specs import ProcessSpec

_MARK = 'COMPOSER_SYSTEM'
_LAST_WORDS_SEC = 1.0
# Runs in the new process, before its program: to be killed with whoever started it.
_LAUNCHER = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]):
    os._exit(1)
os.execvpe(sys.argv[2], sys.argv[2:], os.environ)
"""


@dataclass(slots=True)
class LiveProcess:
    """A process of the system.

    Attributes:
        popen: The running one, `None` before the first start.
        restarts: How often it was started again.
        is_done: Whether it has ended for good.
    """

    spec: ProcessSpec
    popen: subprocess.Popen[bytes] | None = None
    restarts: int = 0
    is_done: bool = False

    @property
    def is_running(self) -> bool:
        """Whether it runs now."""
        return self.popen is not None and self.popen.poll() is None

    @property
    def is_ready(self) -> bool:
        """Whether it runs, or has ended well."""
        return self.popen is not None and self.popen.poll() in (None, 0)


class Processes:
    """All processes of a system.

    Args:
        end_system: Called with an exit code when a required process has ended.
        timeout_sec: What a process gets to end that says nothing else.
    """

    def __init__(
        self,
        specs: Iterable[ProcessSpec],
        end_system: Callable[[int], None],
        timeout_sec: float,
    ) -> None:
        self.by_name = {spec.name: LiveProcess(spec) for spec in specs}
        self._end_system = end_system
        self._timeout_sec = timeout_sec
        self._mark = uuid.uuid4().hex
        self._stopping = threading.Event()
        self._guardian: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._wanted: queue.SimpleQueue[tuple[LiveProcess, queue.SimpleQueue[Any]] | None] = (
            queue.SimpleQueue()
        )
        self._starter: threading.Thread | None = None

    def start(self, process: LiveProcess) -> None:
        """Start a process.

        Raises:
            StartError: Its program is not there, or cannot be run.
        """
        if self._starter is None:
            self._prepare()
        answer: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._wanted.put((process, answer))
        error = answer.get()
        if error is not None:
            raise error

    def stop(self) -> None:
        """End all processes, and whatever they have started."""
        self._stopping.set()
        running = [process for process in self.by_name.values() if process.is_running]
        threads = [threading.Thread(target=self._end, args=(process,)) for process in running]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        if self._starter is None:
            return
        guardian.kill_marked(self._marked_variable())
        self._wanted.put(None)
        self._starter.join()
        self._dismiss_guardian()
        if self._folder is not None:
            self._folder.cleanup()

    def _prepare(self) -> None:
        self._guardian = subprocess.Popen(  # noqa: S603 - our own script
            [sys.executable, '-I', '-S', guardian.__file__, str(os.getpid()), self._marked()],
            stdin=subprocess.PIPE,
            start_new_session=True,
        )
        self._folder = tempfile.TemporaryDirectory(prefix='composer-')
        # The kernel watches over the thread that starts a process, so one starts them all.
        self._starter = threading.Thread(target=self._start_wanted, daemon=True)
        self._starter.start()

    def _dismiss_guardian(self) -> None:
        if self._guardian is None or self._guardian.stdin is None:
            return
        with suppress(OSError):
            self._guardian.stdin.write(b'.')
            self._guardian.stdin.close()
        self._guardian.wait()

    def _marked(self) -> str:
        return f'{_MARK}={self._mark}'

    def _marked_variable(self) -> bytes:
        return self._marked().encode()

    def _start_wanted(self) -> None:
        while (wanted := self._wanted.get()) is not None:
            process, answer = wanted
            try:
                self._start(process)
            except StartError as error:
                answer.put(error)
            except OSError as error:
                message = f"process '{process.spec.name}' cannot be started: {error}"
                answer.put(StartError(message))
            else:
                answer.put(None)

    def _start(self, process: LiveProcess) -> None:
        spec = process.spec
        environment = {**os.environ, **spec.env, _MARK: self._mark}
        command = [*_find_program(spec, environment), *self._ros_arguments(spec)]
        process.popen = subprocess.Popen(  # noqa: S603 - what the file says
            [sys.executable, '-I', '-S', '-c', _LAUNCHER, str(os.getpid()), *command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=spec.cwd,
            env=environment,
            start_new_session=True,
        )
        hearing = threading.Thread(target=_hear, args=(spec.name, process.popen), daemon=True)
        hearing.start()
        watching = threading.Thread(target=self._watch, args=(process, hearing), daemon=True)
        watching.start()

    def _ros_arguments(self, spec: ProcessSpec) -> list[str]:
        if not spec.is_ros:
            return []
        arguments = ['--ros-args']
        if spec.node_name is not None:
            arguments += ['-r', f'__node:={spec.node_name}']
        if spec.namespace is not None:
            arguments += ['-r', f'__ns:={spec.namespace}']
        for old, new in spec.remap:
            arguments += ['-r', f'{old}:={new}']
        if spec.parameters and self._folder is not None:
            path = Path(self._folder.name, f'{spec.path[-1]}.yaml'.replace('/', '_'))
            _write_parameters(path, spec.parameters)
            arguments += ['--params-file', str(path)]
        for file in spec.parameter_files:
            arguments += ['--params-file', file]
        if spec.log_level is not None:
            arguments += ['--log-level', spec.log_level]
        return arguments

    def _watch(self, process: LiveProcess, hearing: threading.Thread) -> None:
        """Wait for the end of a process, and do what is to be done then."""
        popen = process.popen
        if popen is None:
            return
        code = popen.wait()
        # What it has started may hold its output open for as long as it likes.
        hearing.join(_LAST_WORDS_SEC)
        if self._stopping.is_set():
            return
        name = process.spec.name
        say = system_logger.info if code == 0 else system_logger.error
        say(f"process '{name}' {_describe_end(code)}")
        if self._is_restarted(process, code):
            process.restarts += 1
            if not self._stopping.wait(process.spec.restart_delay_sec):
                self._restart(process)
            return
        process.is_done = True
        if process.spec.required:
            system_logger.error(f"process '{name}' is required: the system ends")
            self._end_system(1)

    def _is_restarted(self, process: LiveProcess, code: int) -> bool:
        spec = process.spec
        if spec.restart == 'never' or (spec.restart == 'on_failure' and code == 0):
            return False
        if spec.most_restarts is None or process.restarts < spec.most_restarts:
            return True
        system_logger.error(
            f"process '{spec.name}' was started again {spec.most_restarts} times: that is all"
        )
        return False

    def _restart(self, process: LiveProcess) -> None:
        try:
            self.start(process)
        except StartError as error:
            system_logger.error(str(error))
            process.is_done = True

    def _end(self, process: LiveProcess) -> None:
        popen, spec = process.popen, process.spec
        if popen is None:
            return
        timeout_sec = self._timeout_sec if spec.stop_timeout_sec is None else spec.stop_timeout_sec
        _signal(popen, signal.Signals[spec.stop_signal])
        try:
            popen.wait(timeout_sec)
        except subprocess.TimeoutExpired:
            system_logger.error(
                f"process '{spec.name}' did not end within {timeout_sec:g} s of "
                f'{spec.stop_signal}, and is killed'
            )
            _signal(popen, signal.SIGKILL)
            popen.wait()


def _find_program(spec: ProcessSpec, environment: Mapping[str, str]) -> list[str]:
    """Return the program and its own arguments.

    Raises:
        StartError: There is no such program.
    """
    if spec.package is None:
        program = spec.command[0]
        where = Path(spec.cwd or '.', program)
        found = program if '/' not in program else str(where)
        if shutil.which(found, path=environment.get('PATH')) is None:
            message = f"process '{spec.name}': there is no program '{program}'"
            raise StartError(message)
        return list(spec.command)
    for path in list_executables(spec.package):
        if path.name == spec.executable:
            return [str(path), *spec.arguments]
    message = f"process '{spec.name}': '{spec.package}' has no executable '{spec.executable}'"
    raise StartError(message)


def _write_parameters(path: Path, parameters: Mapping[str, Any]) -> None:
    """Write a parameter file; JSON is YAML, and its strings are strings in every version of it."""
    path.write_text(json.dumps({'/**': {'ros__parameters': dict(parameters)}}))


def _hear(name: str, popen: subprocess.Popen[bytes]) -> None:
    """Print what a process prints, each line with its name in front."""
    if popen.stdout is None:
        return
    with popen.stdout as output:
        for line in output:
            text = line.decode(errors='backslashreplace').rstrip('\r\n')
            sys.stdout.write(f'[{name}] {text}\n')
            sys.stdout.flush()


def _signal(popen: subprocess.Popen[bytes], number: signal.Signals) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(popen.pid, number)


def _describe_end(code: int) -> str:
    if code >= 0:
        return f'has ended with exit code {code}'
    try:
        return f'was ended by {signal.Signals(-code).name}'
    except ValueError:
        return f'was ended by signal {-code}'
