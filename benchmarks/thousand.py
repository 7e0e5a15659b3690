"""A file of many nodes, each with a publisher and a subscription, and a rally beside them."""

from benchmarks.programs import (
    BARE_READY,
    READY,
    bare_nodes,
    composed,
    printed_figures,
    running,
    start_figures,
)
from benchmarks.systems import idle_nodes, rally, render_system

_SPARE_SEC = 30.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return start time (s), memory (MB) and, for `composer`, round trips/s beside `size` nodes.

    Args:
        side: `composer`, or `rclpy`: the leanest nodes that rclpy can make, created in a loop.
    """
    if side == 'rclpy':
        with running(bare_nodes(0, size, 'lean')) as programs:
            return start_figures(programs, BARE_READY)
    with composed(render_system({**idle_nodes(size), **rally(seconds)})) as program:
        figures = start_figures([program], READY)
        return figures | printed_figures(program, seconds + _SPARE_SEC)
