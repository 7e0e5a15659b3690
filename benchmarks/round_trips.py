"""Round trips between two nodes beside idle ones, by executor."""

import time
from typing import Any

import rclpy
from std_msgs.msg import Empty

from benchmarks.executors import start_spinning

_SETTLE_SEC = 0.7
_SETTLE_PER_NODE_SEC = 0.005
_WARM_UP_SEC = 0.2
_FIRST_ANSWER_SEC = 10.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return round trips per second beside `size` idle nodes; `side` is an executor's name."""
    rclpy.init()
    first, second = rclpy.create_node('first'), rclpy.create_node('second')
    message = Empty()
    count = 0

    def answer(_: Empty) -> None:
        nonlocal count
        count += 1
        ping.publish(message)

    ping = first.create_publisher(Empty, 'ping', 10)
    pong = second.create_publisher(Empty, 'pong', 10)
    first.create_subscription(Empty, 'pong', answer, 10)
    second.create_subscription(Empty, 'ping', lambda _: pong.publish(message), 10)
    start_spinning(side, [first, second, *_make_idle_nodes(size)])
    time.sleep(_SETTLE_SEC + size * _SETTLE_PER_NODE_SEC)
    ping.publish(message)
    end = time.monotonic() + _FIRST_ANSWER_SEC
    while not count:
        if time.monotonic() > end:
            failure = 'the first message was not answered'
            raise TimeoutError(failure)
        time.sleep(_WARM_UP_SEC / 10)
    time.sleep(_WARM_UP_SEC)
    begin, before = time.monotonic(), count
    time.sleep(seconds)
    return {'rate': (count - before) / (time.monotonic() - begin)}


def _make_idle_nodes(count: int) -> list[Any]:
    """Make nodes that do nothing, each with a publisher and a subscription of its own."""
    nodes = []
    for number in range(count):
        node = rclpy.create_node(f'idle_{number}')
        node.create_subscription(Empty, f'idle_{number}', lambda _: None, 1)
        node.create_publisher(Empty, f'idle_{number}', 1)
        nodes.append(node)
    return nodes
