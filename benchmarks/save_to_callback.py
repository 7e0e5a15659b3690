"""How long an edit takes under `composer up --watch`: from the save to the first new callback."""

import json
import random
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.programs import READY, Program, running
from benchmarks.systems import busy_nodes, render_system

_LEAST_EDITS = 2
_LONGEST_PAUSE_SEC = 0.2
_ANSWER_SEC = 20.0
_EMPTY = 'std_msgs/msg/Empty'
_MODULE = """\
from benchmarks.behaviours import tell_edit

EDIT = {edit}


def see(node, edit=0):
    tell_edit(node, edit + EDIT)


def hear(node, message, edit=0):
    tell_edit(node, edit + EDIT)
"""


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return the median and the 95th percentile in ms, with a system of `size` nodes.

    Args:
        side: What is saved: `entity` for the file of the system, in which a timer changes or a
            subscription is recreated; `module` for the module of their behaviours.
    """
    with tempfile.TemporaryDirectory() as name:
        path, module = Path(name, 'system.yaml'), Path(name, 'edited.py')
        path.write_text(_render(size, 0))
        module.write_text(_MODULE.format(edit=0))
        with running(['-m', 'composer', 'up', '--watch', str(path)]) as (program,):
            program.wait_for_line(READY)
            taken: list[float] = []
            end = time.monotonic() + seconds
            while time.monotonic() < end or len(taken) < _LEAST_EDITS:
                time.sleep(random.uniform(0, _LONGEST_PAUSE_SEC))  # noqa: S311 - not a secret
                edit = len(taken) + 1
                is_module = side == 'module'
                text = _MODULE.format(edit=edit) if is_module else _render(size, edit)
                begun = time.monotonic()
                (module if is_module else path).write_text(text)
                taken.append(_wait_for_callback(program, edit) - begun)
    *_, p95 = statistics.quantiles(taken, n=20, method='inclusive')
    return {'median_ms': statistics.median(taken) * 1000, 'p95_ms': p95 * 1000}


def _render(size: int, edit: int) -> str:
    return render_system({**busy_nodes(size - 1), **_edited(edit)})


def _edited(edit: int) -> dict[str, Any]:
    """Return a node of which each edit changes one entity."""
    of_timer, of_subscription = edit // 2 * 2, (edit + 1) // 2 * 2 - 1
    timers = {
        'see': {'rate': 200, 'behaviour': 'edited:see', 'with': {'edit': of_timer}},
        'beat': {'rate': 200, 'publish': 'beat', 'message': {}},
    }
    subscription = {
        'type': _EMPTY,
        'topic': 'beat',
        'qos': 10 + of_subscription % 4,
        'behaviour': 'edited:hear',
        'with': {'edit': of_subscription},
    }
    return {
        'edited': {
            'publishers': {'beat': _EMPTY},
            'subscriptions': {'hear': subscription},
            'timers': timers,
        }
    }


def _wait_for_callback(program: Program, edit: int) -> float:
    """Return when the first callback of an edit ran (monotonic, s)."""
    told: dict[str, float] = json.loads(program.wait_for_line(f'{{"edit": {edit},', _ANSWER_SEC))
    return told['at']
