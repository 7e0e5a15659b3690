from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any, Protocol, TypedDict, cast

if TYPE_CHECKING:
    from composer import Node
    from std_msgs.msg import Int32MultiArray

    class Ticks(TypedDict):
        left: int
        right: int

    class State(Protocol):
        ticks: Ticks
        heading: float
        distance: float
        last: Int32MultiArray | None


def _state(node: Node) -> State:
    return cast('State', node.state)


def start(node: Node) -> None:
    state = _state(node)
    state.distance, state.last = 0.0, None


def ticks(node: Node) -> dict[str, Any]:
    counts = _state(node).ticks
    for side in ('left', 'right'):
        counts[side] += random.randint(0, 3)  # type: ignore[literal-required]
    return {'data': list(counts.values())}


def on_ticks(node: Node, message: Int32MultiArray) -> float | None:
    state = _state(node)
    previous, state.last = state.last, message
    if previous is None:
        return None
    left, right = (now - before for now, before in zip(message.data, previous.data, strict=True))
    state.distance += 0.01 * (left + right) / 2
    state.heading += 0.01 * (right - left) / node.parameters.wheel_base
    return state.heading


def pose(node: Node) -> dict[str, float]:
    state: State = _state(node)
    return {'x': state.distance, 'theta': state.heading}
