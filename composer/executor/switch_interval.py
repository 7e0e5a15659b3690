"""How long a computing callback may keep the GIL from the others.

A thread that wants the GIL beside a computing one gets it after the interpreter's switch interval,
5 ms in CPython. A timer's tick costs exactly one such wait here: from the return of the leader's
epoll to the end of the callback nothing releases the GIL. So the interval is the latency of all
that happens beside a computing callback; and two waits in a row, as when that callback ends just
then, make a 100 Hz timer lose a tick.

Measured (two cores, 100 Hz timer beside a callback that always computes, lateness in ms):

| interval | median | 99 % | lost in 3 s | work of the computing callback |
|---|---|---|---|---|
| 5 ms | 5.1 | 8.5 to 9.5 | 2 to 9 | 100 % |
| 2 ms | 2.2 | 2.6 to 7.7 | 0 to 5 | 100 % |
| 1 ms | 1.1 | 3.5 to 5.2 | 0 | 100 % |
| 0.1 ms | 0.2 | 3.6 to 6.5 | 0 | 98 % |

Bare Python threads show the same medians; what is above them is the kernel's scheduling. One, two
or eight threads that all compute do as much at 1 ms as at 5 ms, within the noise, and round trips
between two nodes cost at most 4 % more. Below 1 ms the kernel decides and nothing is won.
"""

import os
import sys
import threading

INTERVAL_SEC = 0.001


class ShortSwitchInterval:
    """Shortens the interpreter's switch interval while it is entered, in any thread.

    An interval that is shorter already, or that somebody sets meanwhile, is not changed.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._before_sec = 0.0
        os.register_at_fork(after_in_child=self._reset_lock)

    def __enter__(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1 and sys.getswitchinterval() > INTERVAL_SEC:
                self._before_sec = sys.getswitchinterval()
                sys.setswitchinterval(INTERVAL_SEC)

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if self._users or not self._before_sec:
                return
            if sys.getswitchinterval() == INTERVAL_SEC:
                sys.setswitchinterval(self._before_sec)
            self._before_sec = 0.0

    def _reset_lock(self) -> None:
        self._lock = threading.Lock()  # Another thread may have held it, and is not in the child.


short_switch_interval = ShortSwitchInterval()
