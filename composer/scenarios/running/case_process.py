"""The process of a case: forked, captured, limited, and gone with all that it has started."""

from __future__ import annotations

import ctypes
import faulthandler
import os
import pickle
import re
import signal
import sys
import tempfile
from contextlib import suppress
from dataclasses import replace
from time import monotonic
from typing import IO, TYPE_CHECKING, NoReturn, TextIO

from composer.executor.after_fork import flush_output
from composer.scenarios.running.case_results import CaseFailure, CaseResult
from composer.virtual_time.preemption import is_of_composer, is_own_code
from composer.virtual_time.replaced_functions import ReplacedFunction

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

_PR_SET_PDEATHSIG = 1
# A process that does not end by itself at its limit is killed so much later.
_GRACE_SEC = 5.0
# Of longer output, the end is kept.
_LONGEST_OUTPUT = 200_000
# A call, and the innermost one of a thread that waits for its turn, as faulthandler shows them.
_CALL = re.compile(r'^  File "([^"]*)", line .*\n?', re.MULTILINE)
_WAITING = re.compile(
    r'recent call first\):\n  File "[^"]*simulated_threads\.py", line \d+ in (_park|run)'
)
# What may end the process, and says nothing of it.
_ENDS: tuple[tuple[ModuleType, str], ...] = (
    *((os, name) for name in ('_exit', 'kill', 'killpg', 'execv', 'execve')),
    (signal, 'raise_signal'),
)
_TIMEOUT = re.compile(r'^Timeout \(.*\)!\n', re.MULTILINE)

_prctl = ctypes.CDLL(None).prctl


class CaseProcess:
    """A process that runs one case.

    Args:
        run: Runs the case, and returns its result.
        limit_sec: How long it may take.
        captures: Whether its output is kept, instead of shown.

    Attributes:
        descriptor: Readable once the process has ended.
        kill_at: When it has to be killed, of `time.monotonic`.
    """

    def __init__(self, run: Callable[[], CaseResult], limit_sec: float, *, captures: bool) -> None:
        self._limit_sec = limit_sec
        self._started = monotonic()
        self.kill_at = self._started + limit_sec + _GRACE_SEC
        # Without names: nothing is left of them, however a process ends.
        files = [tempfile.TemporaryFile() for _ in range(4)]  # noqa: SIM115 - `end` closes them
        self._result, self._stack, self._output, self._errors = files
        flush_output()
        self._pid = os.fork()
        if not self._pid:
            self._run(run, captures=captures)
        # Until it is waited for, its ID is that of no other process.
        self.descriptor = os.pidfd_open(self._pid)

    def kill(self) -> None:
        """Kill the process, and all that it has started."""
        with suppress(ProcessLookupError):
            os.kill(self._pid, signal.SIGKILL)
        self._kill_group()

    def end(self) -> CaseResult:
        """Wait for the end of the process; return its result."""
        self._kill_group()
        _, status = os.waitpid(self._pid, 0)
        real_sec = monotonic() - self._started
        os.close(self.descriptor)
        result = self._read_result(os.waitstatus_to_exitcode(status))
        ended = replace(
            result,
            real_sec=real_sec,
            output=_read_end(self._output),
            errors=_read_end(self._errors),
        )
        for file in (self._result, self._stack, self._output, self._errors):
            file.close()
        return ended

    def _kill_group(self) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._pid, signal.SIGKILL)

    def _read_result(self, code: int) -> CaseResult:
        self._result.seek(0)
        with suppress(EOFError, pickle.UnpicklingError):
            result = pickle.load(self._result)  # noqa: S301 - our own
            if isinstance(result, CaseResult):
                return result
        written = _read_end(self._stack)
        stack = _shorten(_TIMEOUT.sub('', written))
        if _TIMEOUT.search(written) or monotonic() > self.kill_at:
            message = f'it took longer than {self._limit_sec:g} s of real time'
            return CaseResult((CaseFailure('stuck', message, stack=stack),))
        return CaseResult((CaseFailure('died', f'its process {_explain_end(code)}', stack=stack),))

    def _run(self, run: Callable[[], CaseResult], *, captures: bool) -> NoReturn:
        code = 1
        leave: Callable[[int], NoReturn] = os._exit
        try:
            leave = self._settle(captures=captures)
            pickled = pickle.dumps(run())
            flush_output()
            self._result.write(pickled)
            self._result.flush()
            code = 0
        except BaseException:  # noqa: BLE001 - no error may go on as a second server
            sys.excepthook(*sys.exc_info())
        finally:
            flush_output()
            leave(code)

    def _settle(self, *, captures: bool) -> Callable[[int], NoReturn]:
        """Make the forked process one of its own; return what ends it."""
        os.setpgid(0, 0)
        # If the server is killed, so is this one.
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _take_over_output(self._output, self._errors, captures=captures)
        _forget_the_fork()
        faulthandler.enable(self._stack)
        faulthandler.dump_traceback_later(self._limit_sec, exit=True, file=self._stack)
        leave: Callable[[int], NoReturn] = ReplacedFunction(os._exit).original
        self._ends: list[ReplacedFunction] = []
        for module, name in _ENDS:
            ends = ReplacedFunction(getattr(module, name))
            ends.replace(self._told(ends.original, os.getpid()))
            self._ends.append(ends)
        return leave

    def _told(self, end: Callable[..., object], pid: int) -> Callable[..., object]:
        """Return what ends the process as `end` does, and leaves its stack."""

        def end_with_stack(*arguments: object, **keywords: object) -> object:
            if os.getpid() == pid:
                faulthandler.dump_traceback(self._stack, all_threads=False)
            try:
                return end(*arguments, **keywords)
            finally:
                # It goes on.
                if os.getpid() == pid:
                    self._stack.seek(0)
                    self._stack.truncate()

        return end_with_stack


def _take_over_output(output: IO[bytes], errors: IO[bytes], *, captures: bool) -> None:
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)
    if captures:
        os.dup2(output.fileno(), 1)
        os.dup2(errors.fileno(), 2)
    sys.stdout, sys.stderr = _open_lines(1), _open_lines(2)


def _open_lines(descriptor: int) -> TextIO:
    return open(
        descriptor, 'w', buffering=1, encoding='utf-8', errors='backslashreplace', closefd=False
    )


def _forget_the_fork() -> None:
    """Let the system that runs here be taken for no child of another one."""
    from composer.runtime import forked_children

    forked_children.in_child = False


def _read_end(file: IO[bytes]) -> str:
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - _LONGEST_OUTPUT))
    text = file.read().decode(errors='replace')
    return text if size <= _LONGEST_OUTPUT else f'…{text}'


def _shorten(stacks: str) -> str:
    """Return the calls of behaviours, and of libraries in threads that do not wait.

    If there are none, all calls are returned.
    """
    shown, has_calls = [], False
    for part in stacks.split('\n\n'):
        files = _CALL.findall(part)
        is_shown = any(map(is_own_code, files)) or not _WAITING.search(part)
        short = _CALL.sub(lambda call: '' if is_of_composer(call[1]) else call[0], part)
        if is_shown and (not files or _CALL.search(short)):
            shown.append(short)
            has_calls |= bool(files)
    return '\n\n'.join(shown) if has_calls else stacks


def _explain_end(code: int) -> str:
    if code >= 0:
        return f'ended with exit code {code}'
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f'signal {-code}'
    return f'was ended by {name}'
