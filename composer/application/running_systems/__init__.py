"""Running systems: found on the ROS graph, and asked by the services of their control nodes."""
