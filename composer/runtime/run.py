"""Running a system from start to stop, signals included."""

from __future__ import annotations

import os
import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, ExitCode
from composer.runtime import forks, last_resort
from composer.runtime.logs import log_levels, system_logger
from composer.runtime.system import System

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from types import FrameType

    from composer.language.specs import SystemSpec
    from composer.yaml_text.positions import SourceMap

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Comes when the terminal is closed, often twice: from the shell, and from the kernel.
_HANG_UP = signal.SIGHUP


def run_system(
    spec: SystemSpec,
    positions: SourceMap,
    functions: Mapping[str, Callable[..., Any]],
    *,
    ros_arguments: Sequence[str] = (),
    log_level_requests: Sequence[str] = (),
) -> int:
    """Start a system, wait for its end, and stop it.

    The first SIGINT or SIGTERM stops it, a second one leaves at once with exit code 1, and a third
    one ends the process even if no Python can run. SIGHUP stops it, too, unless it was ignored
    before, as by `nohup`; more of them change nothing. If a behaviour cannot be ended, the process
    is left with its exit code, since its threads cannot be ended either.

    Returns:
        The exit code.

    Raises:
        StartError: It could not be brought up.
        UsageError: The ROS arguments are wrong.
    """
    with log_levels(list(spec.nodes.values()), log_level_requests):
        system = System(spec, positions, functions, ros_arguments, log_level_requests)
        with _stopped_by_signals(system, spec):
            try:
                system.start()
                try:
                    system.wait()
                finally:
                    # Also if something was thrown into this thread.
                    last_resort.arm(spec.longest_stop_sec, len(spec.nodes))
                    code, ended = system.stop()
            except ComposerError as error:
                if system.has_ended:
                    raise
                system_logger.error(str(error))
                code, ended = ExitCode.FAILED, False
            finally:
                last_resort.disarm()
    if not ended:
        _leave(code)
    return code


@contextmanager
def _stopped_by_signals(system: System, spec: SystemSpec) -> Iterator[None]:
    # Python delivers signals to the main thread alone; elsewhere they stay with the caller.
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        if system.stop_requested:
            if number == _HANG_UP:
                return
            system.abandon()
            _leave(ExitCode.FAILED)
        system.request_stop()
        last_resort.arm(spec.longest_stop_sec, len(spec.nodes))
        for each in _SIGNALS:
            last_resort.let_kernel_act_after_next(each)

    handled = list(_SIGNALS)
    if signal.getsignal(_HANG_UP) is not signal.SIG_IGN:
        handled.append(_HANG_UP)
    before: dict[int, Any] = {number: signal.signal(number, handle) for number in handled}
    forks.signal_handlers.update(before)
    try:
        yield
    finally:
        forks.signal_handlers.clear()
        for number, handler in before.items():
            signal.signal(number, handler)


def _leave(code: int) -> None:
    forks.flush_output()
    os._exit(code)
