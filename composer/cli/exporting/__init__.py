"""`composer export`."""
