"""Nodes written by hand, with a publisher and a subscription each, and spun as rclpy spins.

python -m benchmarks.bare_nodes FIRST COUNT STYLE

STYLE is `full` for nodes as rclpy makes them, `lean` for nodes without any service of ROS and
without `/rosout`, which take part in nothing but topics.
"""

import sys
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_msgs.msg import Empty

from benchmarks.programs import BARE_READY


def spin_nodes(first: int, count: int, *, lean: bool) -> None:
    """Create the nodes, say that they are ready, and spin."""
    rclpy.init()
    executor = SingleThreadedExecutor()
    overrides = [Parameter('start_type_description_service', value=False)] if lean else None
    for number in range(first, first + count):
        node = rclpy.create_node(
            f'bare_{number}',
            use_global_arguments=False,
            start_parameter_services=not lean,
            enable_rosout=not lean,
            parameter_overrides=overrides,
        )
        node.create_publisher(Empty, f'bare_topic_{number}', 10)
        node.create_subscription(Empty, f'bare_topic_{number}', lambda _: None, 10)
        executor.add_node(node)
    print(BARE_READY, flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == '__main__':
    spin_nodes(int(sys.argv[1]), int(sys.argv[2]), lean=sys.argv[3] == 'lean')
