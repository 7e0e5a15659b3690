"""Runs cases of scenario files, each in a process of its own."""
