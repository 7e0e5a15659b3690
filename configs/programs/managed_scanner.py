"""A managed node in plain rclpy: it publishes scans while it is active."""

from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan


class Scanner(LifecycleNode):
    """Publishes `scan`."""

    def __init__(self) -> None:
        """Wait to be configured."""
        super().__init__('scanner')

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the device, if there were one."""
        self._publisher = self.create_lifecycle_publisher(
            LaserScan, 'scan', qos_profile_sensor_data
        )
        self._timer = self.create_timer(0.1, self._scan)
        return super().on_configure(state)

    def _scan(self) -> None:
        message = LaserScan(range_min=0.1, range_max=10.0, ranges=[1.0, 2.0, 1.5])
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = 'scanner'
        self._publisher.publish(message)


def main() -> None:
    """Run until a signal comes."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Scanner())
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
