"""Which values a node gets from parameter files: rcl merges the files, rclpy picks what matches.

In short: later files win over earlier ones, and in a file what stands further down. In detail, as
measured with rclpy 7.1 and rcl 9.2:

- names of nodes count in the order in which each is first met, over all files: the last of them
  that matches wins, however special it is;
- below one name of nodes, a value of another type does not replace the one before it: the one
  counts whose type comes first in bool, integer, double, string, and then arrays likewise.

Sources: `find_node`, `find_parameter` and `parse_value` in rcl
(`rcl_yaml_param_parser/src/parse.c`), `Node::get_parameters` in rclpy
(`rclpy/src/rclpy/node.cpp`).
"""

from __future__ import annotations

import bisect
from collections import ChainMap
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.ros_parameters.node_patterns import PatternIndex
from composer.ros_parameters.parameter_types import PARAMETER_TYPES
from composer.ros_parameters.rcl_values import parse_override

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from composer.ros_parameters.file_reader import ParameterEntry, ParameterFile

_SCALARS = tuple(name for name in PARAMETER_TYPES if not name.endswith('_array'))
_ARRAYS = tuple(name for name in PARAMETER_TYPES if name.endswith('_array'))
_ORDER = (*_SCALARS, *_ARRAYS)
_PARAMETER_OPTIONS = ('-p', '--param')


def find_overrides(files: Iterable[ParameterFile], full_name: str) -> dict[str, ParameterEntry]:
    """Return the values that a node takes from its parameter files, by parameter name."""
    return dict(MergedFiles(files).find_overrides(full_name))


class MergedFiles:
    """The values of parameter files as rcl merges them, for all nodes that have these files."""

    def __init__(self, files: Iterable[ParameterFile]) -> None:
        tables: dict[str, _Table] = {}
        for file in files:
            for pattern, _ in file.patterns:
                tables.setdefault(pattern, _Table())
            for entry in file.entries:
                tables[entry.pattern].add(entry)
        self._values = {pattern: table.values() for pattern, table in tables.items()}
        self._index = PatternIndex(tables)

    def find_overrides(self, full_name: str) -> Mapping[str, ParameterEntry]:
        """Return the values that a node takes, by parameter name; nodes share what is equal."""
        tables = [self._values[each] for each in self._index.find(full_name)]
        return ChainMap(*reversed(tables))


def parse_command_line(
    ros_arguments: Sequence[str], full_name: str
) -> Mapping[str, tuple[Any, str]]:
    """Return value and type of the parameters that `-p` gives a node, by parameter name.

    Empty lists have no type and are left out.
    """
    found: dict[str, tuple[Any, str]] = {}
    for option, rule in pairwise(ros_arguments):
        if option not in _PARAMETER_OPTIONS or ':=' not in rule:
            continue
        where, _, text = rule.partition(':=')
        node_name, _, name = where.rpartition(':')
        given = parse_override(text)
        if given is None or (node_name and f'/{node_name}' != full_name):
            continue
        value, type_name = given
        if type_name is not None:
            found[name] = value, type_name
    return found


def find_names_given(ros_arguments: Sequence[str], full_name: str) -> set[str]:
    """Return the names of the parameters that the command line gives a node a value of."""
    files = [text for option, text in pairwise(ros_arguments) if option == '--params-file']
    names = set(parse_command_line(ros_arguments, full_name))
    if files:
        from composer.ros_parameters.file_reader import read_parameter_file

        names |= find_overrides(map(read_parameter_file, map(Path, files)), full_name).keys()
    return names


@dataclass(slots=True)
class _Table:
    """The parameters of one name of nodes, in rcl's order; some names may be in it twice."""

    _names: list[str] = field(default_factory=list)
    _slots: list[dict[str | None, ParameterEntry]] = field(default_factory=list)
    _indices: dict[str, list[int]] = field(default_factory=dict)

    def add(self, entry: ParameterEntry) -> None:
        index = 0
        for count in range(len(entry.keys) - entry.opened, len(entry.keys) + 1):
            if count:
                index = self._place(entry.keys[:count])
        self._slots[index][entry.type] = entry

    def values(self) -> dict[str, ParameterEntry]:
        """Return the value that wins for each parameter."""
        found = {}
        for name, slots in zip(self._names, self._slots, strict=True):
            best = min(slots, key=_rank, default=None)
            if slots:
                found[name] = slots[best]
        return found

    def _place(self, keys: tuple[str, ...]) -> int:
        """Return the index of a key; a key in a mapping replaces the name of that mapping."""
        name = '.'.join(keys)
        sought = '.'.join(keys[:-1]) or name
        if self._indices.get(sought):
            index = self._indices[sought].pop(0)
            self._names[index] = name
        else:
            index = len(self._names)
            self._names.append(name)
            self._slots.append({})
        bisect.insort(self._indices.setdefault(name, []), index)
        return index


def _rank(type_name: str | None) -> int:
    return len(_ORDER) if type_name is None else _ORDER.index(type_name)
