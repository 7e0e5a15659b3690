"""Expressions in YAML: `{{ … }}`, `foreach` and `when`.

Importing jinja2 takes as long as a small check: only files that have expressions pay for it.
"""

from __future__ import annotations

# The sections whose entries may be repeated.
SECTIONS = ('nodes', 'include', 'processes')

# The words that an expression does not read as names.
_RESERVED = frozenset(
    ('and', 'else', 'if', 'in', 'is', 'not', 'or', 'self', 'true', 'false', 'none')
) | {'True', 'False', 'None'}


def is_variable_name(name: str) -> bool:
    """Return whether an expression can use a name."""
    return name.isidentifier() and name not in _RESERVED
