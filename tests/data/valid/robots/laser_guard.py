import math

from geometry_msgs.msg import Twist
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

RED, GREEN = ColorRGBA(r=1.0, a=1.0), ColorRGBA(g=1.0, a=1.0)


def rays(node, message):
    low, high = node.parameters.sector
    angle = message.angle_min
    for distance in message.ranges:
        if low <= angle <= high and message.range_min < distance < message.range_max:
            yield distance
        angle += message.angle_increment


def scan(node, message):
    before = node.state.nearest
    node.state.nearest = min(rays(node, message), default=math.inf)
    is_blocked = node.state.nearest < node.parameters.stop_distance
    if is_blocked != (before < node.parameters.stop_distance):
        node.logger.warning('blocked' if is_blocked else 'free again')
    node.publish('blocked', is_blocked)


def command(node, message):
    mode = node.parameters.mode
    if mode == 'off' or message.linear.x <= 0.0:
        return message
    if node.state.nearest < node.parameters.stop_distance:
        return {'angular': {'z': message.angular.z}}
    if mode == 'slow' and node.state.nearest < node.parameters.slow_distance:
        slowed = Twist()
        slowed.linear.x = message.linear.x * 0.5
        slowed.angular = message.angular
        return slowed
    return message


def show(node):
    nearest = node.state.nearest
    if math.isinf(nearest):
        return
    marker = Marker(ns='guard', id=1, type=Marker.SPHERE, action=Marker.ADD)
    marker.header.frame_id = 'laser'
    marker.header.stamp = node.now().to_msg()
    marker.pose.position.x = float(nearest)
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = 0.2
    marker.color = RED if nearest < node.parameters.stop_distance else GREEN
    node.publish('marker', marker)
