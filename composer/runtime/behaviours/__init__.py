"""Behaviours: importing and calling them, what they wait for, and their errors."""
