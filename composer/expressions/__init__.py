"""Expressions in YAML: `{{ … }}`, `foreach` and `when`.

Importing jinja2 takes as long as a small check: only files that have expressions pay for it.
"""

from __future__ import annotations

from typing import Any

# The sections whose entries may be repeated; so may the entities of nodes.
SECTIONS = ('nodes', 'include', 'processes')

# The words that an expression does not read as names.
_RESERVED = frozenset(
    ('and', 'else', 'if', 'in', 'is', 'not', 'or', 'self', 'true', 'false', 'none')
) | {'True', 'False', 'None'}


def is_variable_name(name: str) -> bool:
    """Return whether an expression can use a name."""
    return name.isidentifier() and name not in _RESERVED


def is_conditional(entry: Any) -> bool:
    """Return whether an entry is repeated, or may be left out."""
    return isinstance(entry, dict) and ('foreach' in entry or 'when' in entry)


def has_conditions(section: Any) -> bool:
    """Return whether an entry of a section is repeated, or may be left out."""
    return isinstance(section, dict) and any(map(is_conditional, section.values()))
