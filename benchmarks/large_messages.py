"""Large messages from one node to subscriptions of another, handed over or sent."""

from __future__ import annotations

import json
import time
from array import array
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from benchmarks.programs import READY, composed, printed_figures
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from sensor_msgs.msg import Image

    from composer import Node

_KEPT = 40
_PERIOD_SEC = 0.05
_SPARE_SEC = 60.0
_MB = 1_000_000
_PAGE = 4096

# Images that may be published again.
_pool: list[Image] = []


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return what messages cost that go to all subscriptions.

    The figures are `us`, from `publish` to the last callback (median), and `kept_share`: the
    memory of messages that all keep, in sizes of one.

    Args:
        side: `local` or `dds`, then `image`: 6 MB to one subscription, or `shared`: 1 MB to so
            many that only read.
        size: How many subscriptions.
    """
    way, kind = side.split('_')
    megabytes = 6 if kind == 'image' else 1
    text = render_system(
        _system(size, megabytes, int(seconds / _PERIOD_SEC), read_only=kind == 'shared'),
        local_delivery=way == 'local',
    )
    with composed(text) as program:
        program.wait_for_line(READY)
        return printed_figures(program, _SPARE_SEC)


def _system(readers: int, megabytes: int, timed: int, *, read_only: bool) -> dict[str, Any]:
    image = {'topic': 'image', 'type': 'sensor_msgs/msg/Image', 'qos': 5}
    reading = {
        **image,
        'behaviour': f'{__name__}:note',
        'with': {'readers': readers, 'timed': timed},
        'read_only': read_only,
    }
    sending = {
        'period': _PERIOD_SEC,
        'behaviour': f'{__name__}:send',
        'with': {'megabytes': megabytes},
    }
    return {
        'source': {'publishers': {'image': image}, 'timers': {'send': sending}},
        'readers': {
            'state': {'begun': 0.0, 'left': 0, 'times': [], 'kept': [], 'memory': 0},
            'subscriptions': {f'reader_{each}': reading for each in range(readers)},
        },
    }


def send(node: Node, megabytes: int) -> None:
    """Publish an image that says when; making it is not measured."""
    from sensor_msgs.msg import Image

    if not _pool:
        _pool.append(Image(data=array('B', bytes(megabytes * _MB))))
    _pool[-1].header.frame_id = repr(time.perf_counter())
    node.publish('image', _pool.pop())


def note(node: Node, message: Image, readers: int, timed: int) -> None:
    """Note when the last of `readers` has a message, `timed` times; keep some, print figures."""
    state = node.state
    now, begun = time.perf_counter(), float(message.header.frame_id)
    if begun != state.begun:
        state.begun, state.left = begun, readers
    state.left -= 1
    if state.memory:
        state.kept.append(message)
    if state.left:
        return
    if not state.memory:
        _pool.append(message)
    state.times.append(now - begun)
    if len(state.times) == timed:
        state.memory = _resident()
    elif len(state.times) == timed + _KEPT:
        share = (_resident() - state.memory) / len(message.data) / _KEPT
        print(json.dumps({'us': median(state.times) * 1e6, 'kept_share': share}), flush=True)
        node.shutdown()


def _resident() -> int:
    return int(Path('/proc/self/statm').read_text().split()[1]) * _PAGE
