"""Ends the process at once: by Python, or without it where no Python code runs any more.

A call into C that keeps the interpreter's lock (of `ctypes.PyDLL`, or of a broken extension)
stops every thread of Python, also the one that handles signals. Then only a thread of
`faulthandler`, written in C, and the kernel's default actions for signals still work.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import sys
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    import signal

# How much longer than its timeouts a stop may take: the nodes are destroyed after them.
_MARGIN_SEC = 10.0
_MARGIN_PER_NODE_SEC = 0.02

# Of <bits/sigaction.h>: the action becomes the default one when the signal is delivered.
_SA_RESETHAND = 0x80000000
_MASK_BYTES = 128


class _SigAction(ctypes.Structure):
    """`struct sigaction` of glibc and musl on 64-bit Linux."""

    _fields_ = (
        ('handler', ctypes.c_void_p),
        ('mask', ctypes.c_ubyte * _MASK_BYTES),
        ('flags', ctypes.c_int),
        ('restorer', ctypes.c_void_p),
    )


def leave(code: int) -> NoReturn:
    """End the process with this exit code, whatever its threads do."""
    flush_output()
    os._exit(code)


def flush_output() -> None:
    """Write the buffers of standard output and error, if that is still possible."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()


def schedule(stop_sec: float, nodes: int) -> None:
    """Have the process end with exit code 1 and all stacks if a stop takes far too long.

    Args:
        stop_sec: The sum of the stop's timeouts.
        nodes: How many nodes are destroyed.
    """
    after_sec = stop_sec + _MARGIN_SEC + nodes * _MARGIN_PER_NODE_SEC
    stderr: Any = sys.__stderr__
    try:
        faulthandler.dump_traceback_later(after_sec, exit=True, file=stderr)
    except (AttributeError, RuntimeError, ValueError):
        # There is no standard error, or a behaviour has closed it.
        faulthandler.dump_traceback_later(after_sec, exit=True, file=_open_null_device())


@cache
def _open_null_device() -> int:
    return os.open(os.devnull, os.O_WRONLY | os.O_CLOEXEC)


def cancel() -> None:
    """Cancel the scheduled end: the stop is over."""
    faulthandler.cancel_dump_traceback_later()


def let_kernel_act_after_next(number: signal.Signals) -> None:
    """Let Python handle a signal once more; the kernel ends the process at the one after that."""
    if not sys.platform.startswith('linux') or sys.maxsize < 2**32:
        return
    libc = ctypes.CDLL(None)
    action = _SigAction()
    if libc.sigaction(int(number), None, ctypes.byref(action)) == 0:
        action.flags |= ctypes.c_int(_SA_RESETHAND).value
        libc.sigaction(int(number), ctypes.byref(action), None)
