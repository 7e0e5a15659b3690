"""What blocks a thread, and the clocks, as they are: virtual time replaces them for its threads.

This is imported before anything is replaced.
"""

from __future__ import annotations

import _thread
import time
from types import SimpleNamespace
from typing import Any, Final

from composer.virtual_time.replaced_functions import ReplacedFunction

# Who looks so often at a clock without a wait waits for the time.
MOST_LOOKS: Final = 1000
LOCK_TYPE: Final = type(_thread.allocate_lock())

REAL: Final[Any] = SimpleNamespace(
    allocate_lock=_thread.allocate_lock,
    # Of the type, for all locks: what is looked up in a lock is replaced.
    acquire=LOCK_TYPE.__dict__['acquire'],
    start_new_thread=ReplacedFunction(_thread.start_new_thread).original,
    get_ident=ReplacedFunction(_thread.get_ident).original,
    monotonic=ReplacedFunction(time.monotonic).original,
    monotonic_ns=ReplacedFunction(time.monotonic_ns).original,
    sleep=ReplacedFunction(time.sleep).original,
)
