from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from typing import Any, TypeAlias

from composer import Node
from geometry_msgs.msg import Pose, PoseStamped
from nav_msgs.msg import Path

Payload: TypeAlias = 'dict[str, Any]'


def _stamped(node: Node, pose: Pose, frame: str = 'map') -> PoseStamped:
    stamped = PoseStamped(pose=pose)
    stamped.header.frame_id = frame
    stamped.header.stamp = node.now().to_msg()
    return stamped


def _edge(node: Node, start: complex, end: complex, steps: int = 3) -> Generator[PoseStamped, None, int]:
    for i in range(steps):
        at = start + (end - start) * i / steps
        pose = Pose()
        pose.position.x, pose.position.y = at.real, at.imag
        pose.orientation.w = 1.0
        yield _stamped(node, pose)
    return steps


def square(node: Node) -> Iterator[PoseStamped | None]:
    s = node.parameters.side
    corners = [0, s, s + s * 1j, s * 1j]
    total = 0
    for _ in range(node.parameters.laps):
        for a, b in zip(corners, corners[1:] + corners[:1]):
            total += yield from _edge(node, a, b)
            yield None
    node.logger.info(f'{total} poses')


def circle(node: Node, radius: float, points: int) -> Iterator[Path]:
    while True:
        path = Path()
        path.header.frame_id = 'map'
        path.poses = [
            _stamped(node, Pose(position=_on_circle(radius, math.tau * i / points))) for i in range(points)
        ]
        yield path


def _on_circle(radius, angle):
    from geometry_msgs.msg import Point
    return Point(x=radius * math.cos(angle), y=radius * math.sin(angle))


def follow(node: Node, target: PoseStamped) -> None:
    p = target.pose.position
    previous = node.own_state.get('previous', p)
    node.own_state['previous'] = p
    distance = math.dist((p.x, p.y, p.z), (previous.x, previous.y, previous.z))
    node.state.travelled = getattr(node.state, 'travelled', 0.0) + distance
    node.logger.debug(f'{node.state.travelled:.2f} m')
