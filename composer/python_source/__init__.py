"""What a behaviour's source says, without importing it."""
