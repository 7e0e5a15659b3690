"""Read the source of behaviours without importing it."""
