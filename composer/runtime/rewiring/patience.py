"""Calls that may never end, each in a thread that can be left behind."""

from __future__ import annotations

import ctypes
import threading
from time import monotonic
from typing import TYPE_CHECKING, TypeVar

from composer.errors import ComposerError
from composer.runtime.behaviours.callables import ImportAbandonedError
from composer.runtime.behaviours.stacks import format_thread
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

_T = TypeVar('_T')
_POLL_SEC = 0.05
_WARN_AFTER_SEC = 5.0
_INTERRUPT_SEC = 0.5


def import_with_patience(function: Callable[[], _T], gives_up: Callable[[], bool]) -> _T:
    """Call a function that imports modules, for as long as nobody gives up; say if it takes long.

    Raises:
        ComposerError: It was given up. A module that loops was interrupted; one that waits in C
            goes on waiting in its thread, and cannot be imported again until it ends.
    """
    results: list[_T] = []
    failures: list[BaseException] = []

    def run() -> None:
        try:
            results.append(function())
        except BaseException as error:  # noqa: BLE001 - it is raised below
            failures.append(error)

    thread = threading.Thread(target=run, name='import behaviours', daemon=True)
    begun, was_told = monotonic(), False
    thread.start()
    while thread.is_alive():
        thread.join(_POLL_SEC)
        if thread.is_alive() and gives_up():
            _leave(thread)
            message = 'an import of behaviours was given up'
            raise ComposerError(message)
        if monotonic() - begun > _WARN_AFTER_SEC and not was_told:
            was_told = True
            stack = format_thread(thread.ident or 0)
            system_logger.warning(f'reload: importing behaviours has not ended; it is at\n{stack}')
    if failures:
        raise failures[0]
    return results[0]


def _leave(thread: threading.Thread) -> None:
    """End a thread if it executes Python code; else leave it."""
    _raise_in(thread, ImportAbandonedError)
    thread.join(_INTERRUPT_SEC)
    if thread.is_alive():
        # Raised much later, it would remove the module of the same name from those imported.
        _raise_in(thread, None)


def _raise_in(thread: threading.Thread, error: type[BaseException] | None) -> None:
    what = None if error is None else ctypes.py_object(error)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident or 0), what)
