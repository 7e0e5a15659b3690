"""The commands that record a ROS graph, and publish a recording to it."""
