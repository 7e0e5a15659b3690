"""Virtual time: how much of it passes in a second, and how long a case takes to start."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import render_system
from composer.language.pipeline import load_system_text
from composer.scenarios.running.case_client import CaseClient
from composer.scenarios.running.case_results import CaseRequest

if TYPE_CHECKING:
    from std_msgs.msg import Int64

    from composer import Node

_RATE = 10
_SLICE_SEC = 1.0
_SPARE_SEC = 30.0
_CASES = 10
_ticks = 0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return `speed`, the seconds of the system that pass in one, or `start_sec` of a case.

    Args:
        side: `virtual` or `real`; or `case`: a case of `size` nodes that ends at once.
    """
    if side == 'virtual':
        return {'speed': _measure_virtual(size, seconds)}
    if side == 'case':
        return {'start_sec': _measure_case(size)}
    timers = {'tell': {'period': seconds, 'behaviour': f'{__name__}:tell', 'with': {'size': size}}}
    nodes = {**_nodes(size), 'judge': {'timers': timers}}
    with composed(render_system(nodes)) as program:
        program.wait_for_line(READY)
        return printed_figures(program, seconds + _SPARE_SEC)


def hear(_node: Node, _message: Int64) -> None:
    """Count a message."""
    global _ticks  # noqa: PLW0603 - of the process
    _ticks += 1


def tell(node: Node, size: int) -> None:
    """Print how many seconds of messages came in a second, and stop the system."""
    global _ticks  # noqa: PLW0603 - as above
    now = time.monotonic()
    begun = vars(node.state).setdefault('begun', now)
    if begun == now:
        _ticks = 0
        return
    print(json.dumps({'speed': _ticks / (size * _RATE) / (now - begun)}), flush=True)
    node.shutdown()


def _nodes(size: int) -> dict[str, Any]:
    """Return nodes that publish ten times a second, and each hear another one."""
    kind = 'std_msgs/msg/Int64'
    return {
        f'node_{number}': {
            'publishers': {'out': {'topic': f'out_{number}', 'type': kind}},
            'timers': {'tick': {'rate': _RATE, 'publish': 'out', 'message': {'data': number}}},
            'subscriptions': {
                'in': {
                    'topic': f'out_{(number + 1) % size}',
                    'type': kind,
                    'behaviour': f'{__name__}:hear',
                }
            },
        }
        for number in range(size)
    }


def _measure_virtual(size: int, seconds: float) -> float:
    from composer.simulation.simulated_system import SimulatedSystem

    system = SimulatedSystem(load_system_text(render_system(_nodes(size)), Path('bench.yaml')))
    with system:
        system.forward(_SLICE_SEC)
        before, begun = system.now, time.perf_counter()
        while (passed := time.perf_counter() - begun) < seconds:
            system.forward(_SLICE_SEC)
        return (system.now - before) / passed


def _measure_case(size: int) -> float:
    """Return the mean of all cases but the first."""
    case = {'then': [], 'until': 0.1}
    with tempfile.TemporaryDirectory() as folder, CaseClient() as client:
        path = Path(folder, 'bench.scenario.yaml')
        Path(folder, 'bench.yaml').write_text(render_system(_nodes(size)), encoding='utf-8')
        scenario = {'version': 1, 'system': {'file': 'bench.yaml'}, 'cases': {'nothing': case}}
        path.write_text(json.dumps(scenario), encoding='utf-8')
        results = [client.run(CaseRequest(str(path), 'nothing')) for _ in range(_CASES + 1)]
    failed = [result for result in results if not result.has_passed]
    if failed:
        raise RuntimeError(failed[0])
    return sum(result.real_sec for result in results[1:]) / _CASES
