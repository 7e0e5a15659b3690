"""A driver in plain rclpy: it counts what it is told to drive, and publishes its description.

Parameters:
    robot_description: The description of the robot (URDF).
    max_speed: The largest speed (m/s).
"""

from contextlib import suppress

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PERIOD_SEC = 0.05


class BaseDriver(Node):
    """Subscribes to `cmd_vel`, and publishes `odom` and `robot_description`."""

    def __init__(self) -> None:
        """Start driving."""
        super().__init__('base_driver')
        description = self.declare_parameter('robot_description', '').value
        self._max_speed = self.declare_parameter('max_speed', 1.0).value
        self._speed = 0.0
        self._odometry = Odometry(child_frame_id='base_link')
        self._odom = self.create_publisher(Odometry, 'odom', 10)
        self._description = self.create_publisher(String, 'robot_description', LATCHED)
        self._description.publish(String(data=description))
        self.create_subscription(Twist, 'cmd_vel', self._obey, 10)
        self.create_timer(PERIOD_SEC, self._drive)

    def _obey(self, message: Twist) -> None:
        self._speed = min(message.linear.x, self._max_speed)

    def _drive(self) -> None:
        self._odometry.pose.pose.position.x += self._speed * PERIOD_SEC
        self._odometry.twist.twist.linear.x = self._speed
        self._odom.publish(self._odometry)


def main() -> None:
    """Drive until a signal comes."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(BaseDriver())
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
