"""What an edit does to a system: the difference between two readings of it, as operations."""
