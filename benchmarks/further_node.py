"""What one more node in a system costs."""

from benchmarks.programs import BARE_READY, READY, bare_nodes, composed, running, start_figures
from benchmarks.systems import idle_nodes, render_system


def measure(side: str, size: int, _seconds: float) -> dict[str, float]:
    """Return the start time (ms) and memory (MB) of each node after the first, over `size` nodes.

    Args:
        side: `composer` or `rclpy` (written by hand), each with `-plain` nodes, or nodes
            `-parameters`, which have their services.
    """
    few, many = _start(side, 1), _start(side, 1 + size)
    return {
        'start_ms': (many['start_sec'] - few['start_sec']) * 1000 / size,
        'memory_mb': (many['memory_mb'] - few['memory_mb']) / size,
    }


def _start(side: str, count: int) -> dict[str, float]:
    maker, kind = side.split('-')
    if maker == 'composer':
        text = render_system(idle_nodes(count, parameters=kind == 'parameters'))
        with composed(text) as program:
            return start_figures([program], READY)
    style = 'full' if kind == 'parameters' else 'lean'
    with running(bare_nodes(0, count, style)) as programs:
        return start_figures(programs, BARE_READY)
