import math

from geometry_msgs.msg import PoseArray, PoseStamped, TwistStamped


def bearing(point) -> tuple[float, float]:
    return math.hypot(point.x, point.y), math.atan2(point.y, point.x)


def see(node, message: PoseArray) -> None:
    poses = sorted(message.poses, key=lambda pose: bearing(pose.position)[0])
    if not poses:
        node.state.seen = None
        return
    nearest = poses[0]
    node.state.seen = bearing(nearest.position)
    target = PoseStamped(header=message.header, pose=nearest)
    node.publish('target', target)


def follow(node) -> TwistStamped | None:
    seen = getattr(node.state, 'seen', None)
    if seen is None:
        return None
    distance, angle = seen
    command = TwistStamped()
    command.header.stamp = node.now().to_msg()
    command.header.frame_id = 'base_link'
    error = distance - node.parameters.distance
    if abs(error) > 0.1:
        command.twist.linear.x = max(-0.3, min(0.8, node.parameters.gain * error))
    command.twist.angular.z = 1.5 * angle
    return command
