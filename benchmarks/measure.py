"""One measurement in this process; prints a JSON object.

python -m benchmarks.measure round_trips composer 200
"""

import itertools
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_msgs.msg import Empty, Int32

from benchmarks.executors import start_spinning

_SETTLE_SEC = 1.0
_MEASURE_SEC = 4.0
_SOAK_SEC = float(os.environ.get('COMPOSER_SOAK_SEC', '60'))
_SOAK_PERIOD_SEC = 0.001


def resident_mb() -> float:
    """Memory of this process in MB."""
    resident_pages = int(Path('/proc/self/statm').read_text().split()[1])
    return resident_pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def make_idle_nodes(count: int, *, plain: bool = False) -> list[Any]:
    """Make nodes that do nothing, each with a publisher and a subscription of its own."""
    nodes = []
    for number in range(count):
        node = rclpy.create_node(
            f'idle_{number}',
            use_global_arguments=False,
            start_parameter_services=not plain,
            enable_rosout=not plain,
        )
        node.create_subscription(Empty, f'idle_{number}', lambda _: None, 1)
        node.create_publisher(Empty, f'idle_{number}', 1)
        nodes.append(node)
    return nodes


def round_trips(name: str, idle: int, *, plain: bool = False) -> dict[str, float]:
    """Round trips per second between two nodes beside `idle` others."""
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
    begin = time.monotonic()
    others = make_idle_nodes(idle, plain=plain)
    made_sec = time.monotonic() - begin
    start_spinning(name, [first, second, *others])
    time.sleep(_SETTLE_SEC + idle * 0.005)
    ping.publish(message)
    time.sleep(0.2)
    begin, before = time.monotonic(), count
    time.sleep(_MEASURE_SEC)
    rate = (count - before) / (time.monotonic() - begin)
    return {'rate': rate, 'made_sec': made_sec, 'memory_mb': resident_mb()}


def many_nodes(name: str, idle: int) -> dict[str, float]:
    """Round trips per second beside plain nodes."""
    return round_trips(name, idle, plain=True)


def idle_cpu(name: str, idle: int) -> dict[str, float]:
    """Percent of one core that nodes with nothing to do use."""
    start_spinning(name, make_idle_nodes(idle))
    time.sleep(_SETTLE_SEC + idle * 0.02)
    begin, used = time.monotonic(), time.process_time()
    time.sleep(_MEASURE_SEC)
    percent = 100 * (time.process_time() - used) / (time.monotonic() - begin)
    return {'percent': percent, 'threads': threading.active_count()}


def compute() -> None:
    """Hold the interpreter for 100 ms."""
    end = time.monotonic() + 0.1
    while time.monotonic() < end:
        sum(range(100))


def tick_in_threads(ticks: list[float]) -> None:
    """Do what `jitter` measures in two bare Python threads: what the machine can do just now."""

    def compute_on() -> None:
        while True:
            compute()

    def tick() -> None:
        due = time.monotonic()
        while True:
            due = max(due + 0.01, time.monotonic() - 0.01)
            time.sleep(max(0.0, due - time.monotonic()))
            ticks.append(time.monotonic())

    for target in (compute_on, tick):
        threading.Thread(target=target, daemon=True).start()


def jitter(name: str, _: int) -> dict[str, float]:
    """Deviation of the period of a 100 Hz timer, in ms, beside a node that always computes."""
    ticks: list[float] = []
    if name == 'threads':
        tick_in_threads(ticks)
    else:
        tick_in_nodes(name, ticks)
    time.sleep(_SETTLE_SEC)
    ticks.clear()
    time.sleep(2 * _MEASURE_SEC)
    seen = list(ticks)
    late = sorted(abs(b - a - 0.01) * 1000 for a, b in itertools.pairwise(seen))
    expected = (seen[-1] - seen[0]) / 0.01 + 1 if len(seen) > 1 else 0
    return {
        'p50_ms': late[len(late) // 2] if late else -1,
        'p99_ms': late[int(len(late) * 0.99)] if late else -1,
        'ticks': len(seen),
        'lost': round(expected) - len(seen),
    }


def tick_in_nodes(name: str, ticks: list[float]) -> None:
    """Tick in one node beside another that computes."""
    clock, computer = rclpy.create_node('clock'), rclpy.create_node('computer')
    clock.create_timer(0.01, lambda: ticks.append(time.monotonic()))
    computer.create_timer(0.001, compute, callback_group=MutuallyExclusiveCallbackGroup())
    start_spinning(name, [clock, computer])


def soak(name: str, _: int) -> dict[str, float]:
    """1,000 messages/s for a while: growth of memory in MB after warm-up, and messages lost."""
    sent = got = 0
    source, sink = rclpy.create_node('source'), rclpy.create_node('sink')
    publisher = source.create_publisher(Int32, 'soak', 1000)

    def publish() -> None:
        nonlocal sent
        publisher.publish(Int32(data=sent))
        sent += 1

    def take(message: Int32) -> None:
        nonlocal got
        got += message.data >= 0

    source.create_timer(_SOAK_PERIOD_SEC, publish)
    sink.create_subscription(Int32, 'soak', take, 1000)
    start_spinning(name, [source, sink])
    time.sleep(10)
    before = resident_mb()
    time.sleep(_SOAK_SEC)
    grown = resident_mb() - before
    return {'grown_mb': grown, 'lost': max(0, sent - got - 1), 'rate': sent / (_SOAK_SEC + 10)}


MEASUREMENTS: dict[str, Callable[[str, int], dict[str, float]]] = {
    'round_trips': round_trips,
    'many_nodes': many_nodes,
    'idle_cpu': idle_cpu,
    'jitter': jitter,
    'soak': soak,
}

if __name__ == '__main__':
    rclpy.init()
    result = MEASUREMENTS[sys.argv[1]](sys.argv[2], int(sys.argv[3]))
    print(json.dumps(result), flush=True)
    os._exit(0)
