"""Parameters of nodes as a file in ROS's own format, which rcl reads back as the same values."""

from __future__ import annotations

import math
import re
import sys
from typing import TYPE_CHECKING, Any

from composer.yaml_text.writer import quote_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_PLAIN_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_.]*')


def render_parameter_file(nodes: Mapping[str, Mapping[str, tuple[str, Any]]]) -> str:
    """Return the text of a parameter file.

    Args:
        nodes: Type and value of each parameter, by its name, by the full name of its node.
    """
    lines = [line for name, values in nodes.items() for line in _node_lines(name, values)]
    return '\n'.join(lines or ['# no node has parameters']) + '\n'


def _node_lines(name: str, values: Mapping[str, tuple[str, Any]]) -> Iterator[str]:
    if not values:
        return
    yield f'{name}:'
    written = list(_parameter_lines(values))
    has_some = any(not line.lstrip().startswith('#') for line in written)
    yield '  ros__parameters:' if has_some else '  ros__parameters: {}'
    yield from written


def _parameter_lines(values: Mapping[str, tuple[str, Any]]) -> Iterator[str]:
    for name, (type_name, value) in values.items():
        key = name if _PLAIN_NAME.fullmatch(name) else quote_text(name)
        if type_name == 'byte_array':
            yield f'    # {key}: a parameter file has no bytes'
        elif value == []:
            yield f'    # {key}: an empty list has no type in a parameter file'
        elif isinstance(value, list):
            yield f'    {key}: [{", ".join(map(_scalar, value))}]'
        else:
            yield f'    {key}: {_scalar(value)}'


def _scalar(value: Any) -> str:
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, str):
        return quote_text(value)
    return _double(value) if isinstance(value, float) else str(value)


def _double(value: float) -> str:
    if math.isnan(value):
        return '.nan'
    if math.isinf(value):
        return '.inf' if value > 0 else '-.inf'
    # Of the smallest numbers rcl reads only those that are written exactly.
    return value.hex() if 0 < abs(value) < sys.float_info.min else repr(value)
