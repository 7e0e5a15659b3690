"""Nodes that each need a core for most of the time: in processes of their own, or in one."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

from benchmarks.programs import READY, composed, start_figures
from benchmarks.systems import idle_nodes, render_system

if TYPE_CHECKING:
    from composer import Node

_RATE_HZ = 20.0
_SHARE = 0.8
_SETTLE_SEC = 1.0
_SPARE_SEC = 60.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return how much nodes do, or how long they take to start.

    The figures are `rate`, the calls in a second of `size` nodes that each need 80 % of a core, or
    `start_sec`, until as many idle nodes are up.

    Args:
        side: `workers`, or `one` for one process, and after `start_` for the time to start.
    """
    starts, side = side.startswith('start_'), side.removeprefix('start_')
    nodes = idle_nodes(size) if starts else _busy_nodes(size, seconds)
    if side == 'workers':
        nodes = {name: {**node, 'worker': f'worker_{name}'} for name, node in nodes.items()}
    with composed(render_system(nodes)) as program:
        if starts:
            return {'start_sec': start_figures([program], READY)['start_sec']}
        program.wait_for_line(READY)
        lines = [
            program.wait_for_line(f'"node": "{name}"', seconds + _SPARE_SEC) for name in nodes
        ]
        return {'rate': sum(json.loads(line)['rate'] for line in lines)}


def _busy_nodes(count: int, seconds: float) -> dict[str, Any]:
    work = {'steps': _steps_in(_SHARE / _RATE_HZ), 'seconds': seconds}
    timer = {'rate': _RATE_HZ, 'behaviour': f'{__name__}:work', 'with': work}
    state = {'begun': 0.0, 'first': 0.0, 'calls': 0, 'told': False}
    return {
        f'busy_{number}': {'state': state, 'timers': {'work': timer}} for number in range(count)
    }


def _steps_in(seconds: float) -> int:
    """Return how many steps of work take so long, with a core for themselves."""
    steps = 100_000
    begun = time.thread_time()
    _compute(steps)
    return round(steps * seconds / (time.thread_time() - begun))


def _compute(steps: int) -> int:
    total = 0
    for number in range(steps):
        total += number & 3
    return total


def work(node: Node, steps: int, seconds: float) -> None:
    """Compute, and print how often that was possible, once."""
    state = node.state
    state.begun = state.begun or time.monotonic()
    _compute(steps)
    passed = time.monotonic() - state.begun - _SETTLE_SEC
    if passed < 0:
        return
    if not state.calls:
        state.first = passed
    state.calls += 1
    if state.calls > 1 and state.first + seconds <= passed and not state.told:
        state.told = True
        rate = (state.calls - 1) / (passed - state.first)
        print(json.dumps({'node': node.name, 'rate': rate}), flush=True)
