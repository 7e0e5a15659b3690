"""Runs a system from start to stop, and handles signals."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import threading
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, NoReturn

from composer import signals
from composer.errors import ComposerError, ExitCode, StartError
from composer.executor.after_fork import flush_output
from composer.processes.guardian_client import GuardianClient
from composer.runtime import forked_children
from composer.runtime.control.readiness import (
    is_service,
    notify,
    take_notify_socket,
)
from composer.runtime.logs import log_levels, system_logger, warn_of_unknown_loggers
from composer.runtime.stop import limit_stop
from composer.runtime.stop_request import StopRequest
from composer.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path
    from types import FrameType

    from composer.language.specs import SystemSpec
    from composer.runtime.control.control_services import Commands
    from composer.runtime.local_part import SystemRecorder
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.tracing.tracer import TracePart
    from composer.runtime.workers.workers import Workers

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Sent when the terminal is closed, often twice: by the shell and by the kernel. systemd sends it
# with SIGTERM, and Python handles it first.
_HANG_UP = signal.SIGHUP
_EXIT_SEC = 10.0


def run_system(  # noqa: PLR0913 - one for each part
    reading: Reading,
    *,
    watch: Callable[[System], AbstractContextManager[object]] | None = None,
    commands: Commands | None = None,
    ros_arguments: Sequence[str] = (),
    log_level_requests: Sequence[str] = (),
    recorder: SystemRecorder | None = None,
    workers: Workers | None = None,
    hold: Path | None = None,
    write_trace: Callable[[dict[str, TracePart]], object] | None = None,
    ends_process: bool = False,
) -> int:
    """Start a system, wait until a stop is requested, and stop it.

    The first SIGINT or SIGTERM stops the system, and a second one ends the process at once with
    exit code 1, whoever asked for the stop. SIGHUP stops the system, too, unless it was ignored
    before, as by `nohup`; it never counts as one of the two. If a behaviour does not end, this
    ends the process with the exit code, since its thread cannot end. The guardian ends it if no
    Python code can run. A SIGINT before the system is up gives the exit code 130.

    Args:
        reading: What it runs as.
        watch: Entered with the system once it is up; left before it stops.
        commands: What the system does with its files when it is asked; `None` if it is not to be
            asked.
        recorder: Records the topics of the system; `None` if nothing does.
        workers: Run the nodes that are in workers, and have imported their behaviours; `None` if
            all run in this process.
        hold: While this file is there, no behaviour starts; `None` for no such file.
        write_trace: See `System`.
        ends_process: Whether the process exits afterwards: that is how a large system ends fast,
            and how the processes that behaviours have started end with it.

    Returns:
        The exit code.

    Raises:
        StartError: The system could not start.
        UsageError: The ROS arguments are wrong.
    """
    stop, spec = StopRequest(), reading.spec
    with (
        log_levels(list(spec.nodes.values()), log_level_requests),
        _guarded(spec, ends_process=ends_process) as guardian,
        _handling_signals(stop, guardian.descriptor),
    ):
        warn_of_unknown_loggers(spec, log_level_requests)
        system = System(
            reading,
            guardian,
            ros_arguments,
            log_level_requests,
            stop_request=stop,
            commands=commands,
            recorder=recorder,
            workers=workers,
        )
        system.hold, system.write_trace = hold, write_trace
        guardian.wait_until_begun()
        # A program that runs a system in itself tells its own parent.
        notify_socket = take_notify_socket() if ends_process else None
        try:
            system.start()
            if system.state.is_up:
                notify(notify_socket, 'READY=1')
            if ends_process:
                # To look for garbage in what has been imported and created so far would stop all
                # callbacks for many milliseconds, again and again.
                gc.freeze()
            try:
                with watch(system) if watch else nullcontext():
                    system.wait()
            finally:
                # Also if a signal handler of a behaviour raised an error in this thread.
                code, ended = system.stop()
        except ComposerError as error:
            code, ended = ExitCode.FAILED, False
            if system.has_ended:
                signals.end_with(code)
                raise
            system_logger.error(str(error))
        signals.end_with(code)
        if not ended:
            guardian.end_stop()
            _end_process(code)
    return code


def _end_process(code: int) -> NoReturn:
    """End the process at once, whatever its threads do."""
    flush_output()
    os._exit(code)


@contextmanager
def _guarded(spec: SystemSpec, *, ends_process: bool) -> Iterator[GuardianClient]:
    stop_sec = limit_stop(spec, ends_process=ends_process)
    try:
        guardian = GuardianClient(stop_sec, _EXIT_SEC, owns_process=ends_process)
    except OSError as error:
        message = f'the guardian, a process of Composer, cannot be started: {error}'
        raise StartError(message) from error
    try:
        yield guardian
    finally:
        if ends_process:
            guardian.end_stop()
            if is_service():
                atexit.register(guardian.wait_until_gone)
        else:
            guardian.send_away()


@contextmanager
def _handling_signals(stop: StopRequest, wake_up: int) -> Iterator[None]:
    # Python handles signals in the main thread alone; elsewhere the caller keeps them.
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    has_come = False

    def handle(number: int, _frame: FrameType | None) -> None:
        nonlocal has_come
        if number != _HANG_UP:
            if has_come:
                stop.kill_processes()
                _end_process(ExitCode.FAILED)
            has_come = True
        if not stop.is_set:  # The system may stop by itself.
            is_early = number == signal.SIGINT and not stop.system_is_up
            stop.make(ExitCode.INTERRUPTED if is_early else ExitCode.DONE)

    handled = list(_SIGNALS)
    if signal.getsignal(_HANG_UP) is not signal.SIG_IGN:
        handled.append(_HANG_UP)
    before: dict[int, Any] = {number: signal.signal(number, handle) for number in handled}
    forked_children.signal_handlers.update(before | signals.previous)
    wake_up_before = signal.set_wakeup_fd(wake_up, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(wake_up_before)
        forked_children.signal_handlers.clear()
        for number, handler in before.items():
            signal.signal(number, handler)
