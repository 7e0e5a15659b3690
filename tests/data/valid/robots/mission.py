"""Drive to some points, one after the other; a generator is resumed by the timer."""

import math
from typing import NamedTuple

from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Path


class Point(NamedTuple):
    x: float
    y: float


POINTS = [Point(1.0, 0.0), Point(1.0, 1.0), Point(0.0, 0.0)]


def hear(node, message):
    node.state.pose = message.pose.pose


def error_to(node, point):
    position = node.state.pose.position
    return math.hypot(point.x - position.x, point.y - position.y)


def towards(node, point):
    position = node.state.pose.position
    command = Twist()
    command.linear.x = node.parameters.speed
    command.angular.z = math.atan2(point.y - position.y, point.x - position.x)
    return command


def drive(node):
    while node.state.pose is None:
        yield None
    while True:
        point = POINTS[node.state.at % len(POINTS)]
        while error_to(node, point) > 0.1:
            yield towards(node, point)
        yield Twist()
        if node.state.at >= len(POINTS) and not node.parameters.loop:
            node.logger.info('done', once=True)
            return
        node.call('light', node.state.at % 2 == 0)
        node.state.at += 1
        begin = node.now()
        while (node.now() - begin).nanoseconds * 1e-9 < node.parameters.pause:
            yield


def show(node):
    path = Path()
    path.header.frame_id = 'map'
    for point in POINTS:
        pose = PoseStamped(header=path.header)
        pose.pose.position.x, pose.pose.position.y = point
        path.poses.append(pose)
    node.publish('path', path)


def skip(node, request):
    node.state.at += 1
    if node.state.at >= len(POINTS):
        return {'success': False, 'message': 'that was the last one'}
    return {'success': True, 'message': str(POINTS[node.state.at])}
