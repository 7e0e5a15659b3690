"""Evaluate the classes of behaviours, and their objects."""
