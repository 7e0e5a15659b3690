"""Round trips between two nodes beside idle ones, by executor."""

import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.publisher import Publisher
from std_msgs.msg import Empty

from benchmarks.executors import start_spinning
from composer.runtime.messages.local_delivery import LocalTopics

_SETTLE_SEC = 0.7
_SETTLE_PER_NODE_SEC = 0.005
_WARM_UP_SEC = 0.2
_FIRST_ANSWER_SEC = 10.0
_LOCAL, _HEARD = '-local', '-heard'


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return round trips per second beside `size` idle nodes.

    Args:
        side: An executor's name; with `-local` its messages are handed over as in a system; with
            `-heard` somebody outside listens, so they are sent.
    """
    rclpy.init()
    name = side.removesuffix(_LOCAL).removesuffix(_HEARD)
    first, second = rclpy.create_node('first'), rclpy.create_node('second')
    message = Empty()
    count = 0

    def answer(_: Empty) -> None:
        nonlocal count
        count += 1
        send_ping(message)

    ping = first.create_publisher(Empty, 'ping', 10)
    pong = second.create_publisher(Empty, 'pong', 10)
    first.create_subscription(Empty, 'pong', answer, 10)
    second.create_subscription(Empty, 'ping', lambda _: send_pong(message), 10)
    send_ping, send_pong = ping.publish, pong.publish
    executor = start_spinning(name, [first, second, *_make_idle_nodes(size)])
    if side.endswith(_LOCAL):
        send_ping, send_pong = _hand_over(executor, {first: ping, second: pong})
    if side.endswith(_HEARD):
        outside = rclpy.create_node('outside')
        for topic in ('ping', 'pong'):
            outside.create_subscription(Empty, topic, lambda _: None, 1)
    time.sleep(_SETTLE_SEC + size * _SETTLE_PER_NODE_SEC)
    send_ping(message)
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


def _hand_over(executor: Any, publishers: dict[Any, Publisher]) -> list[Callable[[Empty], None]]:
    """Return what hands messages to the subscriptions of the publishers' nodes."""
    topics = LocalTopics(executor)
    for node in publishers:
        for subscription in node.subscriptions:
            topics.add_subscription(node, subscription)

    def sender(node: Any, publisher: Publisher) -> Callable[[Empty], None]:
        publish = topics.add_publisher(node, publisher).publish
        # The message is published again and again, so each time it is copied.
        return lambda message: publish(message, is_held=True)

    return [sender(node, publisher) for node, publisher in publishers.items()]


def _make_idle_nodes(count: int) -> list[Any]:
    """Make nodes that do nothing, each with a publisher and a subscription of its own."""
    nodes = []
    for number in range(count):
        node = rclpy.create_node(f'idle_{number}')
        node.create_subscription(Empty, f'idle_{number}', lambda _: None, 1)
        node.create_publisher(Empty, f'idle_{number}', 1)
        nodes.append(node)
    return nodes
