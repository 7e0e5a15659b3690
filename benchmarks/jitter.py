"""A 100 Hz timer beside a node that computes at full load."""

import itertools
import threading
import time

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from benchmarks.executors import start_spinning

_PERIOD_SEC = 0.01
_COMPUTE_SEC = 0.1
_SETTLE_SEC = 1.0


def measure(side: str, _size: int, seconds: float) -> dict[str, float]:
    """Return the deviation of the timer's period in ms, and the ticks that never came.

    Args:
        side: An executor's name; or `threads`, two bare Python threads that do the same: what the
            interpreter and the machine can do just now.
    """
    ticks: list[float] = []
    if side == 'threads':
        _tick_in_threads(ticks)
    else:
        _tick_in_nodes(side, ticks)
    time.sleep(_SETTLE_SEC)
    ticks.clear()
    time.sleep(seconds)
    seen = list(ticks)
    if len(seen) < 2:
        message = f'{len(seen)} ticks in {seconds} s'
        raise RuntimeError(message)
    late = sorted(abs(b - a - _PERIOD_SEC) * 1000 for a, b in itertools.pairwise(seen))
    expected = round((seen[-1] - seen[0]) / _PERIOD_SEC) + 1
    return {
        'p50_ms': late[len(late) // 2],
        'p99_ms': late[int(len(late) * 0.99)],
        'lost': max(0, expected - len(seen)),
    }


def _tick_in_nodes(executor: str, ticks: list[float]) -> None:
    rclpy.init()
    clock, computer = rclpy.create_node('clock'), rclpy.create_node('computer')
    clock.create_timer(_PERIOD_SEC, lambda: ticks.append(time.monotonic()))
    computer.create_timer(0.001, _compute, callback_group=MutuallyExclusiveCallbackGroup())
    start_spinning(executor, [clock, computer])


def _tick_in_threads(ticks: list[float]) -> None:
    def compute_on() -> None:
        while True:
            _compute()

    def tick() -> None:
        due = time.monotonic()
        while True:
            # As a ROS timer: what was missed by more than a period is left out.
            missed = (time.monotonic() - due) // _PERIOD_SEC
            due += _PERIOD_SEC * (max(0, missed) + 1)
            time.sleep(max(0.0, due - time.monotonic()))
            ticks.append(time.monotonic())

    for target in (compute_on, tick):
        threading.Thread(target=target, daemon=True).start()


def _compute() -> None:
    """Hold the interpreter for a while."""
    end = time.monotonic() + _COMPUTE_SEC
    while time.monotonic() < end:
        sum(range(100))
