"""What threads that wait for a condition are told by others."""

import threading
from collections.abc import Callable
from time import monotonic


class News:
    """Wakes whoever waits, to look again at what it waits for."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._count = 0

    def tell(self) -> None:
        """Have all conditions looked at."""
        with self._changed:
            self._count += 1
            self._changed.notify_all()

    def wait_for(self, condition: Callable[[], bool], timeout_sec: float | None) -> bool:
        """Wait until `condition()`, which is called with no lock held; False after the timeout."""
        deadline = None if timeout_sec is None or timeout_sec < 0 else (monotonic() + timeout_sec)
        while True:
            seen = self._count
            if condition():
                return True
            left = None if deadline is None else deadline - monotonic()
            if left is not None and left <= 0:
                return False
            with self._changed:
                if self._count == seen:
                    self._changed.wait(left)
