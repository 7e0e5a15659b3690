"""Checks of behaviours against the nodes that they are bound to."""
