"""Values that are computed from others, and those that are read when the system starts."""
