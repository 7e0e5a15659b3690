"""A system's specification becomes a living system."""
