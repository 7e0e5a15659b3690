"""Expressions in YAML: `{{ … }}`, `foreach` and `when`.

Importing jinja2 takes as long as a small check: only files that have expressions pay for it.
"""

from __future__ import annotations

import re
from typing import Any

# The sections whose entries may be repeated; so may the entities of nodes, and components.
SECTIONS = ('nodes', 'include', 'processes', 'containers', 'workers', 'hosts')

# The words that an expression does not read as names.
_RESERVED = frozenset(
    ('and', 'else', 'if', 'in', 'is', 'not', 'or', 'self', 'true', 'false', 'none')
) | {'True', 'False', 'None'}


_WITH_SEPARATORS = re.compile(r'[^\W\d]\w*([./-]\w+)+')
# The name under which an expression finds all arguments of its file, as in `args['a.b']`.
ARGUMENTS = 'args'
# Among the names that an expression uses: all of them, and not the argument of that name.
ALL_ARGUMENTS = 'args[]'
# The names that stand for something in every expression.
BUILT_IN = frozenset((ARGUMENTS, 'env', 'find', 'here', 'range'))


def is_variable_name(name: str) -> bool:
    """Return whether an expression can use a name."""
    return name.isidentifier() and name not in _RESERVED


def is_argument_name(name: str) -> bool:
    """Return whether an expression can use the name of an argument: also with `.`, `-`, `/`."""
    return is_variable_name(name) or _WITH_SEPARATORS.fullmatch(name) is not None


def written_in_expression(name: str) -> str:
    """Return how an expression writes the name of an argument."""
    is_plain = is_variable_name(name) and name not in BUILT_IN
    return name if is_plain else f"{ARGUMENTS}['{name}']"


def is_conditional(entry: Any) -> bool:
    """Return whether an entry is repeated, or may be left out."""
    return isinstance(entry, dict) and ('foreach' in entry or 'when' in entry)


def has_conditions(section: Any) -> bool:
    """Return whether an entry of a section is repeated, or may be left out."""
    return isinstance(section, dict) and any(map(is_conditional, section.values()))
