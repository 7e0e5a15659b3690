"""ROS interface types: find, describe, build and import them."""
