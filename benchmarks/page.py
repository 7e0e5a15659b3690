"""What a page costs the system that it shows, and how soon there is a picture."""

from __future__ import annotations

import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.request import HTTPCookieProcessor, build_opener

from benchmarks.foxglove_bridge import measure_percent, talking_nodes
from benchmarks.programs import READY, composed, running
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from benchmarks.programs import Program

_NODES_OF_NAMESPACE = 10
# Until the page notices that nobody looks, and the system stops measuring what calls cost.
_SETTLING_SEC = 17.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return what `side` costs.

    Args:
        side: `picture`, or `system`: one that has `size` nodes, which publish at 100 Hz.

    Returns:
        `seconds` from the start of a page of a file until its drawing is there; or percentages of
        one core that the system uses, all of one process: with a page that is `open` in one
        window, with a page that is `closed`, and `alone`, on average before and after them.
    """
    if side == 'picture':
        return _measure_picture(size)
    with composed(render_system(talking_nodes(size))) as program:
        program.wait_for_line(READY)
        before = measure_percent(program, seconds)['percent']
        with running(_page('system')) as (page,):
            with _open(page, 'api/events') as stream:
                threading.Thread(target=_read, args=(stream,), daemon=True).start()
                opened = measure_percent(program, seconds)['percent']
            time.sleep(_SETTLING_SEC)
            closed = measure_percent(program, seconds)['percent']
        after = measure_percent(program, seconds)['percent']
        return {'open': opened, 'closed': closed, 'alone': (before + after) / 2}


def _measure_picture(size: int) -> dict[str, float]:
    following = [number + 1 if number + 1 < size else 0 for number in range(size)]
    nodes = {
        f'node_{number}': {
            'namespace': f'/group_{number // _NODES_OF_NAMESPACE}',
            'publishers': {'out': {'type': 'std_msgs/msg/Empty', 'topic': f'/out_{number}'}},
            'subscriptions': {
                'in': {
                    'type': 'std_msgs/msg/Empty',
                    'topic': f'/out_{before}',
                    'behaviour': 'benchmarks.behaviours:ignore',
                }
            },
        }
        for number, before in enumerate(following)
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'system.yaml'
        path.write_text(render_system(nodes))
        begun = time.monotonic()
        with running(_page(str(path))) as (page,), _open(page, 'api/drawing') as drawing:
            assert b'<svg' in drawing.read()  # noqa: S101 - it is there
            return {'seconds': time.monotonic() - begun}


def _page(name: str) -> list[str]:
    return ['-m', 'composer', 'page', name, '--no-browser']


def _open(page: Program, path: str) -> Any:
    """Open a path of a page with the cookie of its address."""
    address = page.wait_for_line('token=').strip()
    opener = build_opener(HTTPCookieProcessor())
    opener.open(address).close()
    return opener.open(address.partition('?')[0] + path)


def _read(stream: Any) -> None:
    # It is closed at the end, while it is read.
    with suppress(AttributeError, OSError, ValueError):
        for _ in stream:
            pass
