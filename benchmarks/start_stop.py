"""Nodes with parameters and all their services: how long they take to start, and to stop."""

import time

from benchmarks.programs import (
    BARE_READY,
    READY,
    Program,
    bare_nodes,
    composed,
    running,
    start_figures,
)
from benchmarks.systems import idle_nodes, render_system

_QUIET_CPU_SEC = 0.05


def measure(side: str, size: int, _seconds: float) -> dict[str, float]:
    """Return start time and stop time (s) of `size` nodes.

    Args:
        side: `composer`, or `rclpy`: nodes as rclpy makes them, created in a loop.
    """
    if side == 'rclpy':
        with running(bare_nodes(0, size, 'full')) as (program,):
            return _figures(program, BARE_READY)
    with composed(render_system(idle_nodes(size, parameters=True))) as program:
        return _figures(program, READY)


def _figures(program: Program, ready: str) -> dict[str, float]:
    figures = start_figures([program], ready)
    _wait_until_idle(program)
    return {'start_sec': figures['start_sec'], 'stop_sec': program.stop()}


def _wait_until_idle(program: Program) -> None:
    """Wait until all services are there, which Composer creates after the start."""
    used = float('-inf')
    while (now := program.cpu_sec()) - used > _QUIET_CPU_SEC:
        used = now
        time.sleep(1.0)
