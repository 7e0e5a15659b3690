"""Messages through a system for long: does its memory grow, does a message get lost?"""

import time

from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import render_system, stream

_MOST_WARM_UP_SEC = 20.0
_SPARE_SEC = 30.0


def measure(_side: str, size: int, seconds: float) -> dict[str, float]:
    """Return MB of growth after warm-up, messages lost and sent, at `size` messages a second."""
    warm_up_sec = min(_MOST_WARM_UP_SEC, seconds / 3)
    with composed(render_system(stream(warm_up_sec + seconds, size))) as program:
        program.wait_for_line(READY)
        time.sleep(warm_up_sec)
        # PSS would grow whenever another program ends that uses the same libraries.
        before = program.resident_mb()
        time.sleep(0.9 * seconds)
        grown = program.resident_mb() - before
        return {'grown_mb': grown, **printed_figures(program, 0.1 * seconds + _SPARE_SEC)}
