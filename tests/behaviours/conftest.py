"""What tests of shipped behaviours share: a node as its behaviours see it, and its time."""

from types import SimpleNamespace

import pytest


@pytest.fixture
def behaviour_node(node):
    """Return a node as its behaviours see it."""
    from composer.runtime.nodes.behaviour_node import Node
    from composer.runtime.nodes.created_entities import EntityCreation

    return Node(
        node, SimpleNamespace(), {}, SimpleNamespace(), lambda code: None, EntityCreation()
    )


@pytest.fixture
def set_time(node):
    """Return a function that sets the time of the node's clock, in seconds."""
    from rclpy.clock import ClockType
    from rclpy.time import Time

    clock = node.get_clock()
    clock._set_ros_time_is_active(True)

    def set_time(seconds):
        nanoseconds = round(seconds * 1e9)
        clock.set_ros_time_override(Time(nanoseconds=nanoseconds, clock_type=ClockType.ROS_TIME))

    return set_time
