"""The behaviours of the systems that are measured."""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from std_msgs.msg import Empty, Int64
    from std_srvs.srv import SetBool

    from composer import Node

_MOST_AT_ONCE = 10
GAP_BUCKET_SEC = 0.1


def ignore(_node: Node, _message: Empty) -> None:
    """Do nothing."""


def ignore_request(_node: Node, _request: object) -> dict[str, object]:
    """Do nothing, and answer so."""
    return {}


def hit_back(node: Node, message: Empty) -> None:
    """Send the ball back."""
    node.publish('pong', message)


def return_ball(node: Node, message: Empty) -> None:
    """Count a round trip and begin the next."""
    node.state.count += 1
    node.publish('ping', message)


def count_round_trips(node: Node, seconds: float) -> Iterator[None]:
    """Throw in one ball, let the players warm up, count for `seconds`, and stop the system."""
    node.publish('ping', {})
    yield
    while not node.state.count:
        yield
    begin, before = time.monotonic(), node.state.count
    while time.monotonic() - begin < seconds:
        yield
    rate = (node.state.count - before) / (time.monotonic() - begin)
    print(json.dumps({'rate': rate}), flush=True)
    node.shutdown()


def comply(_node: Node, request: SetBool.Request) -> dict[str, object]:
    """Agree to what was asked for."""
    return {'success': request.data}


def call_often(node: Node, seconds: float, timeout: float | None) -> Iterator[None]:
    """Call a service over and over for `seconds`, tell how often, and stop the system."""
    begin = time.monotonic()
    count = 0
    while time.monotonic() - begin < seconds:
        node.call('ask', {'data': True}, timeout)
        count += 1
    _tell_rate(node, count, begin)
    yield


async def call_often_async(node: Node, seconds: float, timeout: float | None) -> None:  # noqa: ASYNC109 - of each call
    """As `call_often`, without holding a thread."""
    begin = time.monotonic()
    count = 0
    while time.monotonic() - begin < seconds:
        await node.call_async('ask', {'data': True}, timeout)
        count += 1
    _tell_rate(node, count, begin)


def _tell_rate(node: Node, count: int, begin: float) -> None:
    print(json.dumps({'rate': count / (time.monotonic() - begin)}), flush=True)
    node.shutdown()


def emit(node: Node, seconds: float, per_sec: int) -> Iterator[None]:
    """Send numbers, those that are due at each tick; at the end, how many there were."""
    begin = time.monotonic()
    sent = 0
    while (elapsed := time.monotonic() - begin) < seconds:
        behind = int(elapsed * per_sec) - sent
        # A whole machine may stand still for long: no queue would hold all that is made up for.
        for _ in range(min(behind, _MOST_AT_ONCE)):
            sent += 1
            node.publish('numbers', sent)
        yield
    while True:
        node.publish('numbers', -sent)
        yield


def count(node: Node, message: Int64) -> None:
    """Count the numbers, and say at the end how many did not come."""
    if message.data > 0:
        node.state.got += 1
        return
    sent = -message.data
    print(json.dumps({'sent': sent, 'lost': sent - node.state.got}), flush=True)
    node.shutdown()


def tell_edit(node: Node, edit: int) -> None:
    """Print when an edit is seen for the first time (monotonic, s)."""
    at = time.monotonic()
    if node.own_state.get('edit') != edit:
        node.own_state['edit'] = edit
        # In one write: another thread may print, too.
        sys.stdout.write(json.dumps({'edit': edit, 'at': at}) + '\n')


def send_next(node: Node) -> int:
    """Send the next number."""
    node.state.sent += 1
    return int(node.state.sent)


def note_gap(node: Node, message: Int64) -> None:
    """Count the numbers that did not come, and note the longest gap between two."""
    now, state = time.monotonic(), node.state
    state.lost += message.data - state.number - 1
    state.number = message.data
    state.came = state.came or now
    bucket = int(now / GAP_BUCKET_SEC)
    state.gaps[bucket] = max(state.gaps.get(bucket, 0.0), now - state.came)
    state.came = now


def tell_gaps(node: Node) -> None:
    """Print what `note_gap` noted."""
    gaps = list(node.state.gaps.items())
    print(json.dumps({'lost': node.state.lost, 'gaps': gaps}), flush=True)
