"""Values of a node and of messages where they do not fit, beside some that do."""

# ruff: noqa: G003, PLW2901, RUF005 - so it is written

import math

from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import Path
from sensor_msgs.msg import Joy


class Option:
    def __init__(self, cost):
        self.cost = cost


def signal(level: str):
    return level


def follow(node, path):
    # Python takes what annotations of its own functions do not.
    signal(path)
    for pose in path.poses:
        node.logger.info(str(pose.psoe))  # error
    for pose in reversed(path.poses):
        pose = pose.pose
        node.logger.info(str(pose.position.x))
    for index, stamped in enumerate(path.poses):
        node.logger.info(str(stamped.psoe) + str(index))  # error
    for one, other in zip(path.poses, path.poses[1:], strict=False):
        math.hypot(one.pose.position.x, other.pose.position.w)  # error
    frames = {each.headr.frame_id for each in path.poses}  # error
    last = max(path.poses, key=lambda each: each.pose.position.w)  # error
    best = max([Option(1), Option(2)], key=lambda each: each.cost)
    x, y = path.poses[0].pose.position  # error
    first = path.poses[0].pose['position']  # error
    for each in path.poses[0].pose.position:  # error
        node.logger.info(f'{each}{frames}{last}{best.cost}{x}{y}{first}')
    node.state.path = [each.pose.position for each in path.poses]
    for point in node.state.path:
        node.logger.info(point.label)  # error


def steer(node, joy):
    if joy.axes[0] > '0.5':  # error
        node.publish('cmd_vel', {'linear': [1.0, 0.0, 0.0]})  # error
    node.publish('cmd_vel', Twist(linear=[1.0, 0.0, 0.0]))  # error
    node.publish('cmd_vel', Twist(linear=Vector3(x=joy.axes[1] * 2)))
    turn = joy.axes.x  # error
    turn = joy.axes['x']  # error
    turn = joy.buttons[0].pressed  # error
    axes = dict(enumerate(joy.axes))
    given = Joy(buttons=[1.5])  # error
    given.axes.append('x')  # error
    given.axes.extend([turn, axes[0]])


def plan(node):
    signal(node.parameters.speed)
    speed, frame = node.parameters.speed, node.parameters.frame
    node.logger.info('speed ' + node.parameters.speed)  # error
    node.logger.info(f'speed {speed}' + frame * 2)
    node.logger.info(str([1.0] + node.parameters.speed))  # error
    node.logger.info(str(len(node.parameters.speed)))  # error
    node.logger.info(str(math.sqrt(node.parameters.frame)))  # error
    node.logger.info(str(node.parameters.speed()))  # error
    node.publishers.plan.publish(Path())  # error
    for name, publisher in node.publishers.items():
        if name == 'plan':
            publisher.publish(Path(poses=[PoseStamped()]))
    for waypoint in node.parameters.waypoints:
        node.logger.info(waypoint.x)  # error
    for waypoint in node.parameters.waypoints:
        waypoint = str(waypoint)
        node.logger.info('at ' + waypoint)
    node.sleep('1')  # error
    node.sleep(node.parameters.speed)
    node.state.best = node.now()
    node.logger.info('best ' + node.state.best)  # error
    speed = 'slow' if speed < 1 else 'fast'
    node.logger.info('speed ' + speed)
