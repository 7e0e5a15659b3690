"""What a message costs the processor that goes to another process, on either side.

python -m benchmarks.crossing_cost sending 1000000
python -m benchmarks.crossing_cost taking 1000000

`composer.suggestions.model` has these figures of one machine.
"""

import array
import json
import os
import sys
import threading
import time
from typing import Any

from benchmarks.executors import start_spinning
from benchmarks.programs import running

_PERIOD_SEC = 0.02
_SETTLE_SEC = 1.5
_FIRST_SEC = 20.0
_SEC = 4.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return the microseconds of processor time for a message.

    Args:
        side: `sending` or `taking`: what this process does; another one does the rest.
        size: Of the message, in bytes.
    """
    other = 'taking' if side == 'sending' else 'sending'
    command = ['-m', 'benchmarks.crossing_cost', other, str(size), str(seconds + 2 * _SETTLE_SEC)]
    with running(command):
        return _run(side, size, seconds)


def _run(side: str, size: int, seconds: float) -> dict[str, float]:
    import rclpy
    from sensor_msgs.msg import Image

    rclpy.init()
    node = rclpy.create_node(side)
    if side == 'sending':
        publisher = node.create_publisher(Image, 'crossing', 5)
        message = Image(data=array.array('B', bytes(size)))
        return _send(publisher, message, seconds)
    came = threading.Semaphore(0)
    node.create_subscription(Image, 'crossing', lambda _: came.release(), 5)
    start_spinning('composer', [node])
    return _take(came, seconds)


def _send(publisher: Any, message: Any, seconds: float) -> dict[str, float]:
    deadline = time.monotonic() + _FIRST_SEC
    while not publisher.get_subscription_count() and time.monotonic() < deadline:
        time.sleep(_PERIOD_SEC)
    time.sleep(_SETTLE_SEC)
    count = round(seconds / _PERIOD_SEC)
    used = []
    for step in (lambda: publisher.publish(message), lambda: None):
        before = time.process_time()
        for _ in range(count):
            step()
            time.sleep(_PERIOD_SEC)
        used.append(time.process_time() - before)
    return {'us': (used[0] - used[1]) / count * 1e6}


def _take(came: threading.Semaphore, seconds: float) -> dict[str, float]:
    if not came.acquire(timeout=_FIRST_SEC):
        failure = 'no message came'
        raise TimeoutError(failure)
    time.sleep(_SETTLE_SEC)
    while came.acquire(blocking=False):
        pass
    before, count = time.process_time(), 0
    time.sleep(seconds)
    used = time.process_time() - before
    while came.acquire(blocking=False):
        count += 1
    return {'us': used / max(1, count) * 1e6}


if __name__ == '__main__':
    side_name, size_text, *rest = sys.argv[1:]
    if rest:
        _run(side_name, int(size_text), float(rest[0]))
    else:
        print(json.dumps(measure(side_name, int(size_text), _SEC)), flush=True)
    os._exit(0)
