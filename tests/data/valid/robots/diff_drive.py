import math

from nav_msgs.msg import Odometry
from rclpy.duration import Duration

ENCODER_TICKS = 2048


def clamp(value, limit):
    return max(-limit, min(limit, value))


def hear(node, message):
    limit = node.parameters.max_speed
    node.state.linear = clamp(message.linear.x, limit)
    node.state.angular = message.angular.z
    node.state.heard = node.now()


def step(node):
    state, parameters = node.state, node.parameters
    if is_stale(node):
        state.linear = state.angular = 0.0
    dt = 0.02
    state.yaw += state.angular * dt
    state.x += state.linear * math.cos(state.yaw) * dt
    state.y += state.linear * math.sin(state.yaw) * dt
    half = parameters.wheel_separation / 2
    speeds = [state.linear - state.angular * half, state.linear + state.angular * half]
    node.publish(
        'wheels',
        {
            'header': {'stamp': node.now()},
            'name': ['left_wheel', 'right_wheel'],
            'velocity': [speed / parameters.wheel_radius for speed in speeds],
        },
    )
    return make_odometry(node)


def is_stale(node):
    heard = node.state.heard
    if heard is None:
        return True
    return node.now() - heard > Duration(seconds=node.parameters.command_timeout)


def make_odometry(node):
    message = Odometry(child_frame_id='base_link')
    message.header.stamp = node.now().to_msg()
    message.header.frame_id = node.parameters.frame
    message.pose.pose.position.x = node.state.x
    message.pose.pose.position.y = node.state.y
    message.pose.pose.orientation.z = math.sin(node.state.yaw / 2)
    message.pose.pose.orientation.w = math.cos(node.state.yaw / 2)
    message.pose.covariance[0] = message.pose.covariance[7] = 0.01
    message.pose.covariance[35] = 0.1
    message.twist.twist.linear.x = node.state.linear
    message.twist.twist.angular.z = node.state.angular
    return message


def reset(node, request):
    state = node.state
    state.x, state.y, state.yaw = 0.0, 0.0, 0.0
    return {'success': True, 'message': 'back at the origin'}


def enable(node, request):
    if not request.data:
        node.state.linear = node.state.angular = 0.0
        return {'success': True, 'message': 'stopped'}
    if node.state.heard is None:
        return {'success': False, 'message': 'no command was heard yet'}
    return {'success': True}


def check(node, changes):
    speed = changes.get('max_speed')
    if speed is not None and speed > 2.0:
        return f'{speed} m/s is too fast'
    return None
