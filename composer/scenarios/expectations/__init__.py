"""Expectations of a case, as functions over what happened: no ROS is needed."""
