"""The names of nodes in parameter files, with their wildcards.

`*` is one part of a full name, `**` any number of them, as in `/**/arm`; a part is a wildcard or a
name, never a mixture of both.
Sources: `_validate_name` in rcl (`rcl_yaml_param_parser/src/parse.c`), `Node::get_parameters` in
rclpy (`rclpy/src/rclpy/node.cpp`).
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from composer.names import find_namespace_problem, find_node_name_problem

if TYPE_CHECKING:
    from collections.abc import Iterable

_ONE, _ANY = '*', '**'


class PatternIndex:
    """Names of nodes as parameter files have them, to be matched with many nodes."""

    def __init__(self, patterns: Iterable[str]) -> None:
        self._order = {pattern: place for place, pattern in enumerate(patterns)}
        parts = {pattern: set(_split(pattern)) - {_ONE, _ANY} for pattern in self._order}
        uses = Counter(part for each in parts.values() for part in each)
        # Each stands below its rarest part that is no wildcard: it matches no node without it.
        self._by_part: dict[str | None, list[str]] = {}
        for pattern, literal in parts.items():
            rarest = min(literal, key=uses.__getitem__, default=None)
            self._by_part.setdefault(rarest, []).append(pattern)

    def find(self, full_name: str) -> list[str]:
        """Return those that match a node, in their order."""
        found = [
            pattern
            for part in (None, *dict.fromkeys(_split(full_name)))
            for pattern in self._by_part.get(part, ())
            if matches_pattern(pattern, full_name)
        ]
        return sorted(found, key=self._order.__getitem__)


def find_pattern_problem(pattern: str) -> str | None:
    """Return why rcl refuses a file with such a name of nodes, or `None` if it does not."""
    if pattern in ('/**', '/*'):
        return None
    namespace, _, name = pattern.rpartition('/')
    for part in namespace.removeprefix('/').split('/') if namespace.strip('/') else ():
        if not part:
            return 'a name has no two slashes in a row'
        problem = None if part in (_ONE, _ANY) else find_namespace_problem(f'/{part}')
        if problem:
            return _add_wildcards(problem, part)
    if namespace and not namespace.strip('/'):
        return 'a name has no two slashes in a row'
    problem = None if name in (_ONE, _ANY) else find_node_name_problem(name)
    return _add_wildcards(problem, name) if problem else None


def matches_pattern(pattern: str, full_name: str) -> bool:
    """Return whether a node takes the parameters below `pattern`."""
    parts, names = _split(pattern), _split(full_name)
    # How many parts of the name the parts of the pattern so far can match.
    reached = {0}
    for part in parts:
        if part == _ANY:
            reached = set(range(min(reached), len(names) + 1))
        else:
            reached = {
                count + 1
                for count in reached
                if count < len(names) and part in (_ONE, names[count])
            }
        if not reached:
            return False
    return len(names) in reached


def covers_pattern(wider: str, pattern: str) -> bool:
    """Return whether each node that takes the parameters below `pattern` takes those of `wider`.

    As parts of a name, `*` is matched by wildcards only; `**` stands for no part, and for more
    than `wider` has.
    """
    parts = _split(pattern)
    many = [_ONE] * (len(_split(wider)) + 1)
    return all(
        matches_pattern(wider, '/'.join(each for part in parts for each in _fill(part, fill)))
        for fill in ([], many)
    )


def _fill(part: str, fill: list[str]) -> list[str]:
    return fill if part == _ANY else [part]


def _split(name: str) -> list[str]:
    return name.removeprefix('/').split('/')


def _add_wildcards(problem: str, part: str) -> str:
    return f"{problem}; '*' and '**' must be alone between slashes" if '*' in part else problem
