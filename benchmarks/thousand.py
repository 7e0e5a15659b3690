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
    """Return start time (s) and memory (MB) of `size` nodes; and, for `composer`, of a rally.

    That is round trips/s (`rate`), and the µs that each of the two messages takes (`hop_us`).

    Args:
        side: `composer`, or `rclpy`: the leanest nodes that rclpy can make, created in a loop.
    """
    if side == 'rclpy':
        with running(bare_nodes(0, size, 'lean')) as programs:
            return start_figures(programs, BARE_READY)
    with composed(render_system({**idle_nodes(size), **rally(seconds)})) as program:
        figures = start_figures([program], READY)
        figures |= printed_figures(program, seconds + _SPARE_SEC)
        return figures | {'hop_us': 1e6 / (2 * figures['rate'])}
