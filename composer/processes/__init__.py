"""External processes and their guardian."""
