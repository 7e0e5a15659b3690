"""A driver in plain rclpy that publishes a range, which grows and shrinks in turn.

Parameters:
    rate: Measurements a second.
"""

import math
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Range


class RangeSensor(Node):
    """Publishes `range`."""

    def __init__(self) -> None:
        """Start measuring."""
        super().__init__('range_sensor')
        rate = self.declare_parameter('rate', 10.0).value
        self._publisher = self.create_publisher(Range, 'range', qos_profile_sensor_data)
        self._steps = 0
        self.create_timer(1.0 / rate, self._measure)

    def _measure(self) -> None:
        self._steps += 1
        message = Range(min_range=0.1, max_range=2.0, range=1.0 + 0.9 * math.sin(self._steps / 5))
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = 'range_sensor'
        self._publisher.publish(message)


def main() -> None:
    """Measure until a signal comes."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(RangeSensor())
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
