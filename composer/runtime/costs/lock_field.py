"""Finds where CPython notes which thread holds the interpreter (the GIL).

The structure is the same from Python 3.11 to 3.14, and where it is differs. So it is looked for by
what must stand in it: the switch interval, this thread, and that it is held.
Source: `struct _gil_runtime_state` in Include/internal/pycore_gil.h of CPython.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
import threading
from functools import cache

from composer.records import record
from composer.runtime.costs.lock_sampler import Memory

# Python 3.11 has it in `_PyRuntime`, later ones in the state of the interpreter.
_MOST_BYTES = 1 << 20
_PAGE = 4096
_STATE_BYTES = 512
_US_PER_SEC = 1e6
_WORD = 8


@record
class LockField:
    """Where it is noted.

    Attributes:
        holder: The address of the `PyThreadState` that held it last, and of whether it is held.
        thread_offset: Where a `PyThreadState` has the identifier of its thread.
    """

    holder: int
    thread_offset: int


@cache
def find_lock_field() -> LockField:
    """Return where it is.

    Raises:
        LookupError: This Python has no such lock, or keeps it otherwise; or somebody has changed
            the switch interval right now.
    """
    api = ctypes.pythonapi
    for name in ('PyThreadState_Get', 'PyInterpreterState_Get'):
        getattr(api, name).restype = ctypes.c_void_p
    state = api.PyThreadState_Get()
    thread = struct.pack('=QQ', threading.get_ident(), threading.get_native_id())
    offset = _read_own(state, _STATE_BYTES).find(thread)
    interval = round(sys.getswitchinterval() * _US_PER_SEC)
    pattern = struct.pack('=QQi', interval, state, 1)
    for start in (_runtime_address(), api.PyInterpreterState_Get()):
        at = _read_own(start, _MOST_BYTES).find(pattern)
        if offset >= 0 and at >= 0:
            return LockField(start + at + _WORD, offset)
    message = 'no such lock'
    raise LookupError(message)


def _runtime_address() -> int:
    return ctypes.addressof(ctypes.c_char.in_dll(ctypes.pythonapi, '_PyRuntime'))


def _read_own(address: int, most: int) -> bytes:
    """Return what is there in this process, up to what cannot be read."""
    data = b''
    page = Memory(os.getpid(), _PAGE)
    while len(data) < most and (more := page.read(address + len(data))):
        data += more
        if len(more) < _PAGE:
            break
    return data
