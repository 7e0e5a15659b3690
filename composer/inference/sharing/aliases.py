"""Local names of a function that stand for something else all the time."""

from __future__ import annotations

import ast
from collections import Counter
from typing import TYPE_CHECKING

from composer.python_source.local_names import stored_names

if TYPE_CHECKING:
    from collections.abc import Sequence


def find_aliases(nodes: Sequence[ast.AST]) -> dict[str, ast.expr]:
    """Return what local names of a function stand for: those assigned once.

    A loop, or a second assignment, may make a name stand for something else.
    """
    counts = Counter(each.id for each in stored_names(nodes))
    aliases: dict[str, ast.expr] = {}
    for node in nodes:
        match node:
            case ast.Assign(
                targets=[ast.Name(id=name)],
                value=(ast.Name() | ast.Attribute() | ast.Call()) as value,
            ) if counts[name] == 1:
                aliases[name] = value
    return aliases
