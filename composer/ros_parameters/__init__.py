"""ROS's own parameters: their types, their files, and what overrides them."""
