"""How much processor time another thread of this process has used.

`time.pthread_getcpuclockid` is not safe to ask: it reads what the system may have taken back when
the thread ended. So the clock is named by the thread's number, and Linux refuses it then.
Source: `make_thread_cpuclock` in include/linux/posix-timers_types.h.
"""

from __future__ import annotations

import time

_CLOCK_BITS, _CLOCK_KIND = 3, 6


def read_thread_clock_ns(native: int) -> int | None:
    """Return the processor time of a thread, in nanoseconds; `None` if it has ended.

    Args:
        native: What `threading.get_native_id` says in it.
    """
    try:
        return time.clock_gettime_ns((~native << _CLOCK_BITS) | _CLOCK_KIND)
    except OSError:
        return None
