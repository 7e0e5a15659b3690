"""Nodes in one process of `composer up`, against a process for each."""

from benchmarks.programs import BARE_READY, READY, bare_nodes, composed, running, start_figures
from benchmarks.systems import idle_nodes, render_system


def measure(side: str, size: int, _seconds: float) -> dict[str, float]:
    """Return the time from the first process's start until all `size` nodes are up, and memory.

    Args:
        side: `composer`, or `processes`: as many rclpy programs, started at once.
    """
    if side == 'composer':
        with composed(render_system(idle_nodes(size))) as program:
            return start_figures([program], READY)
    with running(*(bare_nodes(number, 1, 'full') for number in range(size))) as programs:
        return start_figures(programs, BARE_READY)
