"""The ROS context of a system, the ROS graph around it, and the shared memory of Fast DDS."""
