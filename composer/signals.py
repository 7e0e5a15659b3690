"""Signals before a system runs, or after it has stopped: they end the process at once.

Python's `KeyboardInterrupt` would not do: raised while a module is imported, it can be swallowed
there, or leave half of a module behind. While a system runs, `composer.runtime.run` handles them.
"""

from __future__ import annotations

import atexit
import os
import signal
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

HANDLED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

# The handlers before these, by the numbers of their signals; forked children get them back.
previous: dict[int, Any] = {}

# The exit code of what has ended; `None` before.
_code: int | None = None
_interrupts = False


def end_at_signals() -> None:
    """End the process at each signal from now on, but for those that it was started to ignore.

    Those that came while a system started again in this process have waited.
    """
    # A launcher that wants no zombies ignores it, and no exit code of a child is known then.
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    for number in HANDLED:
        if signal.getsignal(number) is not signal.SIG_IGN:
            previous[number] = signal.signal(number, _handle)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDLED)
    # The first one to be registered is the last one to run. Python gives all signals their
    # default actions after it, which would end the process with another exit code.
    atexit.register(_ignore_signals)


def end_with(code: int) -> None:
    """Let later signals, but for SIGHUP, end the process with this exit code: its work is done."""
    global _code  # noqa: PLW0603 - a fact of the whole process
    _code = code


@contextmanager
def interrupting() -> Iterator[None]:
    """Let signals raise `KeyboardInterrupt` first, for work that cleans up after itself."""
    global _interrupts  # noqa: PLW0603 - as above
    _interrupts = True
    try:
        yield
    except KeyboardInterrupt as error:
        _interrupts = False
        for number in error.args:
            _handle(number, None)
        raise
    finally:
        _interrupts = False


@contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield what tells whether a signal has come; the second one ends the process."""
    asked = False

    def handle(number: int, _frame: Any) -> None:
        nonlocal asked
        asked = True
        signal.signal(number, before[number])

    # As `up`: a script has SIGINT ignored in the background, and `nohup` SIGHUP.
    heeded = [
        each
        for each in HANDLED
        if each == signal.SIGINT or signal.getsignal(each) is not signal.SIG_IGN
    ]
    before: dict[int, Any] = {int(each): signal.signal(each, handle) for each in heeded}
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _handle(number: int, _frame: FrameType | None) -> None:
    if _code is not None:
        # A terminal that is closed may send a second one; what is left to do takes no time.
        if number != signal.SIGHUP:
            os._exit(_code)
        return
    if _interrupts:
        raise KeyboardInterrupt(number)
    if number == signal.SIGINT:
        os._exit(ExitCode.INTERRUPTED)
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)


def _ignore_signals() -> None:
    for number in previous:
        signal.signal(number, signal.SIG_IGN)
