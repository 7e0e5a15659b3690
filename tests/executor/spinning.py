"""What the tests of the executor share: waiting, spinning meanwhile, and programs of their own."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sized
from contextlib import contextmanager
from typing import Any

DEADLINE_SEC = 90.0
QUIET_SEC = 0.2


def wait_for(condition: Callable[[], Any]) -> None:
    """Wait until the condition holds; fail after the deadline."""
    end = time.monotonic() + DEADLINE_SEC
    while not condition():
        assert time.monotonic() < end, 'the condition never held'
        time.sleep(0.002)


def wait_until_quiet(calls: Sized) -> None:
    """Wait until a list has stopped growing: a callback under way may still add to it."""

    def is_quiet() -> bool:
        seen = len(calls)
        time.sleep(QUIET_SEC)
        return len(calls) == seen

    wait_for(is_quiet)


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
        executor.shutdown(DEADLINE_SEC)
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()


def run_program(source: str, domain_id: int) -> tuple[list[str], str]:
    """Run a Python program in a ROS domain; return the lines of its output, and its errors."""
    ended = subprocess.run(
        [sys.executable, '-c', source],
        env=os.environ | {'ROS_DOMAIN_ID': str(domain_id)},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    return ended.stdout.splitlines(), ended.stderr
