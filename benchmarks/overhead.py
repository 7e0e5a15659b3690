"""What Composer adds to a message, beside the same lines written by hand on the same executor.

python -m benchmarks.overhead
"""

import json
import os
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node as RosNode
from std_msgs.msg import Int32, String

import composer
from composer.runtime.system import System

_MESSAGES = 2000
_ROUNDS = 15
_ROUND_TIMEOUT_SEC = 60.0
_MEETING_TIMEOUT_SEC = 20.0

KINDS: dict[str, tuple[type, Callable[[Any], Any]]] = {
    'std_msgs/msg/Int32': (Int32, lambda message: Int32(data=message.data + 1)),
    'std_msgs/msg/String': (String, lambda message: String(data=message.data)),
    'geometry_msgs/msg/Twist': (Twist, lambda message: message),
}

_SYSTEM = """
version: 1
nodes:
  relay:
    publishers:
      out: {{type: {type}, topic: composed_out}}
    subscriptions:
      in: {{type: {type}, topic: composed_in, behaviour: parts:answer, publish: out}}
"""


class _Driver:
    """Sends a message and waits for the answer to it, over and over."""

    def __init__(self, node: RosNode, message_class: type) -> None:
        self._message = message_class()
        self._left = 0
        self._done = threading.Event()
        self._publishers = {
            side: node.create_publisher(message_class, f'{side}_in', 10)
            for side in ('composed', 'plain')
        }
        for side, publisher in self._publishers.items():
            node.create_subscription(
                message_class,
                f'{side}_out',
                lambda _, send=publisher.publish: self._next(send),
                10,
            )

    def wait_for_peers(self) -> None:
        """Wait until both sides can be reached."""
        end = time.monotonic() + _MEETING_TIMEOUT_SEC
        while not all(one.get_subscription_count() for one in self._publishers.values()):
            if time.monotonic() > end:
                message = 'the two sides did not meet'
                raise TimeoutError(message)
            time.sleep(0.01)

    def run(self, side: str) -> tuple[float, float]:
        """Return µs of wall time and of processor time of a message there and back."""
        self._left = _MESSAGES
        self._done.clear()
        begin, used = time.perf_counter(), time.process_time()
        self._publishers[side].publish(self._message)
        if not self._done.wait(_ROUND_TIMEOUT_SEC):
            message = f'{self._left} messages of {side} did not come back'
            raise TimeoutError(message)
        elapsed, spent = time.perf_counter() - begin, time.process_time() - used
        return elapsed / _MESSAGES * 1e6, spent / _MESSAGES * 1e6

    def _next(self, send: Callable[[Any], None]) -> None:
        self._left -= 1
        if self._left > 0:
            send(self._message)
        else:
            self._done.set()


def _start_composed(type_name: str, answer: Callable[[Any], Any]) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'overhead.yaml'
        path.write_text(_SYSTEM.format(type=type_name))
        loaded = composer.load(path)
    if loaded.spec is None:
        message = f'the system cannot be read: {loaded.diagnostics}'
        raise ValueError(message)
    functions = {'parts:answer': lambda _node, message: answer(message)}
    system = System(loaded.spec, loaded.positions, functions)
    system.start()
    return system


def _create_plain(context: Any, message_class: type, answer: Callable[[Any], Any]) -> RosNode:
    node = rclpy.create_node('plain', context=context)
    publisher = node.create_publisher(message_class, 'plain_out', 10)

    def reply(message: Any) -> None:
        publisher.publish(answer(message))

    node.create_subscription(message_class, 'plain_in', reply, 10)
    return node


def message_overhead(type_name: str = 'std_msgs/msg/Int32') -> dict[str, float]:
    """µs that Composer adds to: subscription, behaviour, publish.

    Returns:
        The medians over rounds in turn: wall and processor time of both sides, each for a
        message there and back, and the medians of their differences.
    """
    message_class, answer = KINDS[type_name]
    system = _start_composed(type_name, answer)
    context, executor = system._services.context, system._executor  # noqa: SLF001
    plain = _create_plain(context, message_class, answer)
    driving = rclpy.create_node('driver', context=context)
    driver = _Driver(driving, message_class)
    for node in (plain, driving):
        executor.add_node(node)
    driver.wait_for_peers()
    figures = []
    for _ in range(_ROUNDS + 1):
        composed, by_hand = driver.run('composed'), driver.run('plain')
        figures.append(
            (*composed, *by_hand, *(a - b for a, b in zip(composed, by_hand, strict=True)))
        )
    for node in (plain, driving):
        executor.remove_node(node)
        node.destroy_node()
    system.stop()
    keys = (
        'composed_us',
        'composed_cpu_us',
        'plain_us',
        'plain_cpu_us',
        'added_us',
        'added_cpu_us',
    )
    # The first round warms up.
    return {
        key: statistics.median(column)
        for key, column in zip(keys, zip(*figures[1:], strict=True), strict=True)
    }


if __name__ == '__main__':
    results = {name: message_overhead(name) for name in KINDS}
    print(json.dumps(results, indent=2), flush=True)
    os._exit(0)
