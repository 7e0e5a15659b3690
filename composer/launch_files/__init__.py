"""Launch files of ROS 2 → systems; `launch` and `launch_ros` are imported only by `loading`."""
