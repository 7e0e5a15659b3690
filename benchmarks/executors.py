"""The executors that are compared, by name, and how each is made to spin."""

import threading
from collections.abc import Callable
from typing import Any

from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.task import Future

from composer.executor import ComposerExecutor

_FINITE_WAIT_SEC = 0.05

MAKERS: dict[str, Callable[[], Any]] = {
    'composer': ComposerExecutor,
    'multi': MultiThreadedExecutor,
    'single': SingleThreadedExecutor,
    'events': EventsExecutor,
}


def start_spinning(name: str, nodes: list[Any]) -> Any:
    """Spin `nodes` with the executor of that name in a thread of its own; returns the executor."""
    executor = MAKERS[name]()
    for node in nodes:
        executor.add_node(node)
    target = executor.spin
    if name == 'events':

        def target() -> None:
            """Spin with finite waits: the infinite one does not wake up in this release.

            Waiting for a future that is never done, it runs all that comes in one call;
            `spin_once` would be a call for each event, and a fifth slower.
            """
            never = Future()
            while True:
                executor.spin_until_future_complete(never, _FINITE_WAIT_SEC)

    threading.Thread(target=target, daemon=True).start()
    return executor
