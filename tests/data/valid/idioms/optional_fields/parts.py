from __future__ import annotations

import itertools
import math
from typing import Any, Optional

from sensor_msgs.msg import JointState


def states(node) -> dict[str, Any]:
    payload: dict[str, Any] = {'name': ['a', 'b']}
    step = next(node.own_state.setdefault('steps', itertools.count()))
    if step % 2:
        payload['position'] = [math.nan, 1.0]
    if step % 3:
        payload.update(effort=[0.1, 0.2], velocity=(1, 2))
    if not step % 4:
        payload = {**payload, 'header': {'stamp': node.now()}}
    return payload


def _first(values, default: Optional[float] = None) -> Optional[float]:
    return next((v for v in values if not math.isnan(v)), default)


def power(node, msg: JointState) -> float | None:
    if msg.effort and msg.velocity:
        return sum(e * v for e, v in zip(msg.effort, msg.velocity))
    position = _first(msg.position)
    if position is None:
        return None
    return position


def wrench(node, msg: JointState):
    torque = msg.effort[0] if len(msg.effort) else None
    if torque is not None or hasattr(node.state, 'torque'):
        node.state.torque = torque if torque is not None else node.state.torque
        return {'torque': {'z': node.state.torque}}
