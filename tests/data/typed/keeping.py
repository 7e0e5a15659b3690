"""What an object keeps of its node, and of messages."""

import math

from geometry_msgs.msg import Twist


class Keeper:
    def __init__(self, node):
        self.node = node
        self.limit = node.parameters.speed
        self.words = []

    def hear(self, node, odometry):
        for each in self.node.parameters.speed:  # error
            node.logger.info(f'{each}')
        self.words.append('at ' + self.node.parameters.speed)  # error
        node.logger.info(f'{self.limit + "m"}')  # error
        self.words.append(odometry.child_frame_id)
        if self.node.parameters.frame == 3:  # error
            self.words.clear()

    def drive(self, node):
        twist = Twist()
        twist.angular.z = math.sqrt(self.node.parameters.frame)  # error
        node.logger.info(f'{self.node.parameters.names["a"]}')  # error
        began = self.node.now()
        self.words.append('began ' + (began - self.node.now()))  # error
        return twist


class Follower:
    def __init__(self, node):
        self.last = None
        self.mixed = None
        self.started = None

    def follow(self, node, odometry):
        self.last = odometry
        self.mixed = odometry if node.parameters.speed > 1.0 else node.now()
        self.started = node.now()
        node.state.place = odometry.pose
        node.state.stamp = odometry.header.stamp

    def look(self, node):
        if self.last is None or node.state.stamp is None:
            return
        node.logger.info(f'{self.last.pose.pose} {self.mixed.pose}')
        node.logger.info(f'{(node.now() - self.started).nanosecond}')  # error
        node.logger.info(f'{node.now() - node.state.stamp}')  # error
        node.logger.info(f'{node.state.place.pose.position}')
        node.logger.info(f'{self.last.pose.positions}')  # error
        if node.now() - self.started > 2.0:  # error
            self.last.pose.pose.position.x = 'far'  # error

    def turn(self, node, path):
        for pose in path.poses:
            _ahead(pose.pose, node.parameters.speed)
            node.logger.info(f'{_x_of(pose, is_stamped=True)}')
        _wait(node, node.parameters.mode, node.parameters.frame)


def _ahead(pose, speed):
    pose.orientation.w = 1  # error
    pose.position.x = speed
    return speed.x  # error


def _x_of(pose, is_stamped):
    if is_stamped:
        return pose.pose.position.x
    return pose.position.x


def _wait(node, mode, frame):
    node.logger.info(mode.upper())
    node.sleep(frame)  # error
