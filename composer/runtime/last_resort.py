"""The end of a process in which no Python runs any more.

A call into C that keeps the interpreter's lock (of `ctypes.PyDLL`, or of a faulty extension)
stops every thread of Python, also the one that would handle signals. What is left is a thread of
`faulthandler`, written in C, and the kernel's own actions at signals.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import sys
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import signal

# How much longer than that a stop may take: the nodes are destroyed after it.
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


def arm(stop_sec: float, nodes: int) -> None:
    """Let the process end with exit code 1 and all stacks if a stop takes far too long.

    Args:
        stop_sec: What it may take.
    """
    after_sec = stop_sec + _MARGIN_SEC + nodes * _MARGIN_PER_NODE_SEC
    stderr: Any = sys.__stderr__
    try:
        faulthandler.dump_traceback_later(after_sec, exit=True, file=stderr)
    except (AttributeError, RuntimeError, ValueError):
        # There is no standard error, or a behaviour has closed it.
        faulthandler.dump_traceback_later(after_sec, exit=True, file=_open_nothing())


@cache
def _open_nothing() -> int:
    return os.open(os.devnull, os.O_WRONLY | os.O_CLOEXEC)


def disarm() -> None:
    """Let the process live on: the stop is over."""
    faulthandler.cancel_dump_traceback_later()


def let_kernel_act_after_next(number: signal.Signals) -> None:
    """Let Python handle a signal once more; the next one after that ends the process by itself."""
    if not sys.platform.startswith('linux') or sys.maxsize < 2**32:
        return
    libc = ctypes.CDLL(None)
    action = _SigAction()
    if libc.sigaction(int(number), None, ctypes.byref(action)) == 0:
        action.flags |= ctypes.c_int(_SA_RESETHAND).value
        libc.sigaction(int(number), ctypes.byref(action), None)
