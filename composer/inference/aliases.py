"""Local names of a function that stand for something else all the time."""

from __future__ import annotations

import ast
from collections import Counter
from typing import TYPE_CHECKING

from composer.python_source.local_names import stored_names

if TYPE_CHECKING:
    from collections.abc import Container, Sequence


def find_aliases(nodes: Sequence[ast.AST], own: Container[str]) -> dict[str, ast.AST]:
    """Return what local names of a function stand for: those assigned once, to no other local one.

    A loop, or a second assignment, may make a name stand for something else.
    """
    counts = Counter(each.id for each in stored_names(nodes))
    aliases: dict[str, ast.AST] = {}
    for node in nodes:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Name() | ast.Attribute()):
                roots = {each.id for each in ast.walk(node.value) if isinstance(each, ast.Name)}
                if counts[name] == 1 and not any(each in own for each in roots):
                    aliases[name] = node.value
    return aliases
