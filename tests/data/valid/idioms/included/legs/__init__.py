"""Legs and a body."""
from . import body, leg
