"""Messages to a topic that nobody subscribes to."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING

from std_msgs.msg import String

from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from composer import Node

_ROUNDS = 10
_SPARE_SEC = 30.0


def measure(_side: str, _size: int, seconds: float) -> dict[str, float]:
    """Return `us`, what `node.publish` takes."""
    timer = {'period': 0.1, 'behaviour': f'{__name__}:shout', 'with': {'seconds': seconds}}
    publisher = {'topic': 'void', 'type': 'std_msgs/msg/String'}
    nodes = {'alone': {'publishers': {'void': publisher}, 'timers': {'shout': timer}}}
    with composed(render_system(nodes)) as program:
        program.wait_for_line(READY)
        return printed_figures(program, seconds + _SPARE_SEC)


def shout(node: Node, seconds: float) -> None:
    """Publish for `seconds`, print what one takes, and stop the system."""
    message = String(data='is anybody there?')
    count, begun = 0, time.perf_counter()
    while (elapsed := time.perf_counter() - begun) < seconds:
        for _ in range(_ROUNDS):
            node.publish('void', message)
        count += _ROUNDS
    print(json.dumps({'us': elapsed / count * 1e6}), flush=True)
    node.shutdown()
