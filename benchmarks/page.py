"""What a page costs the system that it shows, and how soon there is a picture."""

from __future__ import annotations

import tempfile
import threading
import time
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.request import HTTPCookieProcessor, build_opener

from benchmarks.foxglove_bridge import measure_percent, talking_nodes
from benchmarks.programs import READY, composed, running
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from benchmarks.programs import Program

_NODES_OF_NAMESPACE = 10
# Until the page has met the system, and nobody has looked for a while.
_SETTLING_SEC = 8.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return what `side` costs.

    Args:
        side: `open` in one window, `closed`, or `alone` without a page: the percentage of one core
            that a system of `size` nodes uses, which publish at 100 Hz. `picture`: the seconds
            from the start of a page of a file until its drawing is there.
    """
    if side == 'picture':
        return _measure_picture(size)
    with composed(render_system(talking_nodes(size))) as program:
        program.wait_for_line(READY)
        pages = [] if side == 'alone' else [_page('system')]
        with running(*pages) as started:
            window: Any = nullcontext() if side != 'open' else _open(started[0], 'api/events')
            with window as stream:
                if side == 'closed':
                    started[0].wait_for_line('token=')
                    time.sleep(_SETTLING_SEC)
                if stream is not None:
                    threading.Thread(target=_read, args=(stream,), daemon=True).start()
                return measure_percent(program, seconds)


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
