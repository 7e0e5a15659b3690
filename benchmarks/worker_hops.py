"""A message from a process to another and back: between workers, or plain rclpy nodes."""

from __future__ import annotations

import json
import sys
import time
from array import array
from statistics import median
from typing import TYPE_CHECKING, Any

from benchmarks.programs import READY, composed, printed_figures, running
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from sensor_msgs.msg import Image

    from composer import Node

_SPARE_SEC = 60.0
_WARM_UP = 30
_RETRY_SEC = 0.5


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return the microseconds of a hop (median): half a round trip of a message.

    Args:
        side: `workers`, or `rclpy`: two programs, each with a node in `rclpy.spin`.
        size: Of the message, in bytes.
    """
    if side == 'rclpy':
        programs = [
            ['-m', __name__, each, str(size), str(seconds)] for each in ('second', 'first')
        ]
        with running(*programs) as (_, first):
            return printed_figures(first, seconds + _SPARE_SEC)
    with composed(render_system(_system(size, seconds))) as program:
        program.wait_for_line(READY)
        return printed_figures(program, seconds + _SPARE_SEC)


class Rally:
    """Sends a message, takes what comes back, and prints how long a hop took."""

    def __init__(self, send: Any, size: int, seconds: float) -> None:
        from sensor_msgs.msg import Image

        self._send = send
        self._message = Image(data=array('B', bytes(size)))
        self._end = time.monotonic() + seconds
        self._times: list[float] = []
        self._sent = 0.0
        self._is_over = False

    def serve(self) -> None:
        """Begin, and begin anew if nothing comes back: the other one may not be there yet."""
        now = time.monotonic()
        if not self._is_over and now - self._sent > _RETRY_SEC:
            self._hit(self._message)

    def take(self, message: Image) -> None:
        """Take what came back."""
        now = time.monotonic()
        self._times.append(now - self._sent)
        if now < self._end or len(self._times) < 2 * _WARM_UP:
            self._hit(message)
        elif not self._is_over:
            self._is_over = True
            hop_us = median(self._times[_WARM_UP:]) / 2 * 1e6
            print(json.dumps({'us': hop_us}), flush=True)

    def _hit(self, message: Image) -> None:
        self._sent = time.monotonic()
        self._send(message)


def _system(size: int, seconds: float) -> dict[str, Any]:
    kind = {'type': 'sensor_msgs/msg/Image', 'qos': 5}
    begin = {'size': size, 'seconds': seconds}
    return {
        'first': {
            'worker': 'first',
            'state': {'rally': None},
            'on_start': {'behaviour': f'{__name__}:begin', 'with': begin},
            'publishers': {'ping': kind},
            'subscriptions': {'pong': {**kind, 'behaviour': f'{__name__}:take'}},
            'timers': {'serve': {'period': 0.2, 'behaviour': f'{__name__}:serve'}},
        },
        'second': {
            'worker': 'second',
            'publishers': {'pong': kind},
            'subscriptions': {'ping': {**kind, 'behaviour': f'{__name__}:hit_back'}},
        },
    }


def begin(node: Node, size: int, seconds: float) -> None:
    """Get ready."""
    node.state.rally = Rally(lambda message: node.publish('ping', message), size, seconds)


def serve(node: Node) -> None:
    """Begin."""
    node.state.rally.serve()


def take(node: Node, message: Image) -> None:
    """Take what came back."""
    node.state.rally.take(message)


def hit_back(node: Node, message: Image) -> None:
    """Send a message back."""
    node.publish('pong', message)


def _run_plain(name: str, size: int, seconds: float) -> None:
    """Run one of the two nodes as rclpy's tutorials have them."""
    import rclpy
    from sensor_msgs.msg import Image

    rclpy.init()
    node = rclpy.create_node(name)
    if name == 'first':
        rally = Rally(node.create_publisher(Image, 'ping', 5).publish, size, seconds)
        node.create_subscription(Image, 'pong', rally.take, 5)
        node.create_timer(0.2, rally.serve)
    else:
        pong = node.create_publisher(Image, 'pong', 5)
        node.create_subscription(Image, 'ping', pong.publish, 5)
    rclpy.spin(node)


if __name__ == '__main__':
    _run_plain(sys.argv[1], int(sys.argv[2]), float(sys.argv[3]))
