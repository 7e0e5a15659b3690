"""The names that expressions can use for variables."""

from __future__ import annotations

# What an expression reads as a word of its own.
_RESERVED = frozenset(
    ('and', 'else', 'if', 'in', 'is', 'not', 'or', 'self', 'true', 'false', 'none')
) | {'True', 'False', 'None'}


def is_usable_name(name: str) -> bool:
    """Return whether an expression can use a name."""
    return name.isidentifier() and name not in _RESERVED
