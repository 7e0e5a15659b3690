"""Runs a system from start to stop, and handles signals."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer import signals
from composer.errors import ComposerError, ExitCode
from composer.runtime import forced_exit, forked_children
from composer.runtime.logs import log_levels, system_logger
from composer.runtime.stop_request import StopRequest
from composer.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from types import FrameType

    from composer.language.specs import SystemSpec
    from composer.yaml_text.positions import SourceMap

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Sent when the terminal is closed, often twice: by the shell and by the kernel.
_HANG_UP = signal.SIGHUP


def run_system(
    spec: SystemSpec,
    positions: SourceMap,
    functions: Mapping[str, Callable[..., Any]],
    *,
    ros_arguments: Sequence[str] = (),
    log_level_requests: Sequence[str] = (),
    ends_process: bool = False,
) -> int:
    """Start a system, wait until a stop is requested, and stop it.

    The first SIGINT or SIGTERM stops the system, a second one ends the process at once with exit
    code 1, and a third one does so even if no Python code can run. SIGHUP stops the system, too,
    unless it was ignored before, as by `nohup`; further ones change nothing. If a behaviour does
    not end, this ends the process with the exit code, since its thread cannot be ended. A SIGINT
    before the system is up gives the exit code 130.

    Args:
        ends_process: Whether the process exits afterwards: that is how a large system ends fast.

    Returns:
        The exit code.

    Raises:
        StartError: The system could not start.
        UsageError: The ROS arguments are wrong.
    """
    stop = StopRequest()
    with (
        log_levels(list(spec.nodes.values()), log_level_requests),
        _handling_signals(stop, spec),
    ):
        system = System(
            spec,
            positions,
            functions,
            ros_arguments,
            log_level_requests,
            stop_request=stop,
            ends_process=ends_process,
        )
        try:
            system.start()
            try:
                system.wait()
            finally:
                # Also if a signal handler of a behaviour raised an error in this thread.
                forced_exit.schedule(spec.longest_stop_sec, len(spec.nodes))
                code, ended = system.stop()
        except ComposerError as error:
            code, ended = ExitCode.FAILED, False
            if system.has_ended:
                signals.end_with(code)
                raise
            system_logger.error(str(error))
        finally:
            forced_exit.cancel()
        signals.end_with(code)
    if not ended:
        forced_exit.leave(code)
    return code


@contextmanager
def _handling_signals(stop: StopRequest, spec: SystemSpec) -> Iterator[None]:
    # Python handles signals in the main thread alone; elsewhere the caller keeps them.
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        if stop.is_set:
            if number == _HANG_UP:
                return
            stop.kill_processes()
            forced_exit.leave(ExitCode.FAILED)
        is_early = number == signal.SIGINT and not stop.system_is_up
        stop.make(ExitCode.INTERRUPTED if is_early else ExitCode.DONE)
        forced_exit.schedule(spec.longest_stop_sec, len(spec.nodes))
        for each in _SIGNALS:
            forced_exit.let_kernel_act_after_next(each)

    handled = list(_SIGNALS)
    if signal.getsignal(_HANG_UP) is not signal.SIG_IGN:
        handled.append(_HANG_UP)
    before: dict[int, Any] = {number: signal.signal(number, handle) for number in handled}
    forked_children.signal_handlers.update(before | signals.previous)
    try:
        yield
    finally:
        forked_children.signal_handlers.clear()
        for number, handler in before.items():
            signal.signal(number, handler)
