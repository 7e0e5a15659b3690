"""What it costs to show a system of 50 nodes, which publish at 100 Hz, to Foxglove."""

from __future__ import annotations

import json
import re
import threading
import time
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from benchmarks.programs import READY, Program, composed
from benchmarks.systems import render_system

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

    from composer import Node

_SETTLE_SEC = 3.0


def measure(side: str, size: int, seconds: float) -> dict[str, float]:
    """Return the percentage of one core that `size` nodes use.

    Args:
        side: `subscribed` by one client to everything, `idle` without a client, or `alone` without
            the bridge.
    """
    options = [] if side == 'alone' else ['--foxglove', '0']
    with composed(render_system(talking_nodes(size)), *options) as program:
        program.wait_for_line(READY)
        context: Any = nullcontext()
        if side == 'subscribed':
            found = re.search(r'ws://\S+', program.wait_for_line('ws://'))
            url = found[0] if found else ''
            context = connect(url, subprotocols=['foxglove.sdk.v1'], max_size=None)
        with context as socket:
            if socket is not None:
                threading.Thread(target=_read, args=(socket,), daemon=True).start()
            return measure_percent(program, seconds)


def measure_percent(program: Program, seconds: float) -> dict[str, float]:
    """Return the `percent` of one core that a program uses, once it has settled."""
    time.sleep(_SETTLE_SEC)
    begun, before = time.monotonic(), program.cpu_sec()
    time.sleep(seconds)
    return {'percent': 100 * (program.cpu_sec() - before) / (time.monotonic() - begun)}


def talking_nodes(count: int) -> dict[str, Any]:
    """Return nodes that publish at 100 Hz, each on a topic of its own."""
    end = {'topic': 'words', 'type': 'std_msgs/msg/String'}
    timer = {'rate': 100, 'behaviour': f'{__name__}:talk', 'publish': 'out'}
    return {
        f'node_{number}': {
            'parameter_services': False,
            'publishers': {'out': {**end, 'topic': f'words_{number}'}},
            'timers': {'talk': timer},
        }
        for number in range(count)
    }


def _read(socket: ClientConnection) -> None:
    """Subscribe to everything, and take what comes."""
    with suppress(ConnectionClosed):
        for message in socket:
            if isinstance(message, str) and (channels := json.loads(message).get('channels')):
                wanted = [{'id': each['id'], 'channelId': each['id']} for each in channels]
                socket.send(json.dumps({'op': 'subscribe', 'subscriptions': wanted}))


def talk(_node: Node) -> str:
    """Return what is published."""
    return 'x' * 100
