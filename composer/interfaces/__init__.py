"""ROS interface types: find them, describe them, import them."""
