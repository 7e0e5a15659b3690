"""What nodes with nothing to do cost."""

import time

from benchmarks.programs import BARE_READY, READY, Program, bare_nodes, composed, running
from benchmarks.systems import idle_nodes, render_system

_SETTLE_SEC = 3.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return the percentage of one core that `size` idle nodes use.

    Args:
        side: `composer`, or `rclpy`: nodes written by hand on `SingleThreadedExecutor`.
    """
    if side == 'composer':
        with composed(render_system(idle_nodes(size))) as program:
            program.wait_for_line(READY)
            return _watch(program, seconds)
    with running(bare_nodes(0, size, 'lean')) as (program,):
        program.wait_for_line(BARE_READY)
        return _watch(program, seconds)


def _watch(program: Program, seconds: float) -> dict[str, float]:
    time.sleep(min(_SETTLE_SEC, seconds))
    begin, before = time.monotonic(), program.cpu_sec()
    time.sleep(seconds)
    used = program.cpu_sec() - before
    return {'percent': 100 * used / (time.monotonic() - begin)}
