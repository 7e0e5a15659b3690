"""Behaviours: imported, called, waited for, and what happens when they raise."""
