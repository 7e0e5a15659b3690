"""What an object of the project keeps, beside times of the node."""

import enum
import threading

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.duration import Duration
from rclpy.time import Time
from std_msgs.msg import ColorRGBA
from std_srvs.srv import SetBool

NAMES = ['low', 'high']
Level = enum.Enum('Level', [name.upper() for name in NAMES])


class Phase(enum.Enum):
    IDLE = 0
    MOVING = 1


class Beat(threading.Thread):
    def run(self):
        print(self._name, Level.LOW)


class Clock:
    wait = Duration(sec=1)  # error

    def __init__(self, node):
        self._last = node.now()
        self.pose: PoseStamped | None = None
        self.other: PoseStamped | Path | None = None

    def see(self, node, pose):
        node.logger.info(f'{node.now() - pose.header.stamp}')  # error
        now = node.now()
        if now - self._last > 0.5:  # error
            self._last = now
        age = node.now() - Time.from_msg(pose.header.stamp)
        if age > 0.5 or age > Duration(seconds=1):  # error
            node.logger.info(f'{self._lst}')  # error
        if self.pose is not None:
            node.logger.info(f'{self.pose.position} {self.pose.pose}')  # error
        if self.other is not None:
            node.logger.info(f'{self.other.poses}')
        self.pose = pose
        node.logger.info(f'{Phase.IDLE} {Phase.STOPPED}')  # error
        node.logger.info(f'{describe(pose)} {SetBool.DONE}')  # error
        node.logger.info(f'{Duration(1)} {ColorRGBA(r=1.0)}')  # error
        node.logger.info(f'{ColorRGBA(r=None)}')  # error
        node.publish('plan', {'poses': PoseStamped()})  # error
        node.publishers['plan'].enabled = True  # error
        Beat().start()

    def begin(self, node):
        def tick(node):
            node.publish('plan', Path())

        node.create_timer(1.0, tick)
        node.create_timer(1.0, self.stop(node))  # error
        node.create_timer(1.0, self.make(node))
        node.create_publisher(Path, 'more', '10')  # error

    def stop(self, node):
        node.publish('plan', Path())

    def make(self, node):
        return lambda node: node.publish('plan', Path())


def describe(pose: PoseStamped):
    return f'{pose.position}'  # error
