"""Runs a system in virtual time: the nodes themselves, and no time passes but what it says."""
