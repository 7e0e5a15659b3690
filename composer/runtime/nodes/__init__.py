"""One node from start to stop."""
