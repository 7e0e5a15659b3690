from __future__ import annotations

from typing import TypeGuard

from geometry_msgs.msg import Point, Pose, PoseStamped


def pose(node) -> PoseStamped:
    return PoseStamped(pose=Pose(position=Point(x=1.0)))


def on_pose(node, message: PoseStamped) -> None:
    choices = [message, message.pose, message.pose.position, (1.0, 2.0), {'x': 3.0}, None]
    index = node.own_state['index'] = (node.own_state.get('index', -1) + 1) % len(choices)
    node.state.target = choices[index]


def _is_pair(value) -> TypeGuard[tuple[float, float]]:
    return isinstance(value, tuple) and len(value) == 2


def _to_point(target) -> Point | None:
    if target is None:
        return None
    if hasattr(target, 'header'):
        target = target.pose
    if isinstance(target, Pose):
        return target.position
    if _is_pair(target):
        return Point(x=target[0], y=target[1])
    if type(target) is dict:
        return Point(**target)
    assert isinstance(target, Point), target
    return target


def out(node) -> Point | None:
    return _to_point(node.state.target)


def mode(node) -> str | None:
    match node.state.target:
        case PoseStamped(pose=Pose(position=Point(x=x))) if x > 0:
            return f'stamped {x}'
        case Pose(position=position):
            return f'pose {position.x}'
        case Point() as point:
            return f'point {point.x}'
        case (float(x), y):
            return f'pair {x} {y}'
        case {'x': x, **rest} if not rest:
            return f'mapping {x}'
    return None
