"""What it costs to record or trace messages of 1 kB, beside a system that only publishes them."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from std_msgs.msg import String

from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from composer import Node

_SIZE = 1000
_BURST = 20
_PERIOD_SEC = 0.004
_SPARE_SEC = 30.0
# The recorder subscribes to `/rosout` and the like; what that takes is not of the messages.
_SETTLED_SEC = 2.0


def measure(side: str, _size: int, seconds: float) -> dict[str, float]:
    """Return what a message takes, at 5,000 a second.

    Args:
        side: `recorded`, `traced` or `alone`.

    Returns:
        Processor time: `cpu_us` of the whole process, and `publish_us` of the behaviour alone.
    """
    timer = {'period': 0.1, 'behaviour': f'{__name__}:talk', 'with': {'seconds': seconds}}
    publisher = {'topic': 'words', 'type': 'std_msgs/msg/String'}
    # A burst waits in the queue of who hears it: each message has its callback.
    hearer = {**publisher, 'behaviour': f'{__name__}:hear', 'qos': {'depth': 10 * _BURST}}
    nodes = {
        'talker': {'publishers': {'words': publisher}, 'timers': {'talk': timer}},
        'hearer': {'subscriptions': {'words': hearer}},
    }
    with tempfile.TemporaryDirectory() as folder:
        options = {
            'recorded': ['--record', str(Path(folder) / 'words.mcap')],
            'traced': ['--trace', str(Path(folder) / 'words.json')],
        }.get(side, [])
        with composed(render_system(nodes), *options) as program:
            program.wait_for_line(READY)
            return printed_figures(program, seconds + _SPARE_SEC)


def hear(_node: Node, _message: String) -> None:
    """Do nothing with it."""


def talk(node: Node, seconds: float) -> None:
    """Publish for `seconds`, print what a message takes, and stop the system."""
    time.sleep(_SETTLED_SEC)
    message = String(data='x' * _SIZE)
    count, publishing = 0, 0.0
    used, begun = time.process_time(), time.perf_counter()
    while time.perf_counter() < begun + seconds:
        start, used_here = time.perf_counter(), time.thread_time()
        for _ in range(_BURST):
            node.publish('words', message)
        publishing += time.thread_time() - used_here
        count += _BURST
        time.sleep(max(0.0, start + _PERIOD_SEC - time.perf_counter()))
    # What waits is recorded, too.
    time.sleep(_PERIOD_SEC * 50)
    spent = time.process_time() - used
    figures = {'cpu_us': spent / count * 1e6, 'publish_us': publishing / count * 1e6}
    print(json.dumps(figures), flush=True)
    node.shutdown()
