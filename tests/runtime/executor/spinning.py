"""What the tests of the executor share: waiting for a condition, and spinning meanwhile."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

DEADLINE_SEC = 20.0


def wait_for(condition: Callable[[], Any]) -> None:
    """Wait until the condition holds; fail after the deadline."""
    end = time.monotonic() + DEADLINE_SEC
    while not condition():
        assert time.monotonic() < end, 'the condition never held'
        time.sleep(0.002)


@contextmanager
def spinning(executor: Any) -> Iterator[list[BaseException]]:
    """Spin in another thread meanwhile; what spin raised is in the list."""
    errors: list[BaseException] = []

    def spin() -> None:
        try:
            executor.spin()
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield errors
    finally:
        executor.shutdown(5.0)
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()
