"""Lifecycles: the managed nodes of ROS 2 (https://design.ros2.org/articles/node_lifecycle.html)."""
