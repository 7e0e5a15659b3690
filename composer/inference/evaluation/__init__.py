"""Evaluate the expressions of behaviours, and follow their statements and calls."""
