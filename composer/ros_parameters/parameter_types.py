"""The types of ROS parameters, and the type of a YAML value.

Source: `rcl_interfaces/msg/ParameterType`; the names are those of `rclpy.parameter.Parameter.Type`
in lower case.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.names import with_article
from composer.yaml_text.scalars import BOOLS_OF_YAML_1_1, suggest_bool

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.yaml_text.positions import DataPath, SourceMap

_SCALARS: dict[type, str] = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}
PARAMETER_TYPES = (*_SCALARS.values(), *(f'{name}_array' for name in ('byte', *_SCALARS.values())))

INT64_MIN = -(2**63)
INT64_MAX = 2**63 - 1
_BYTE_MAX = 255
_WORDS = tuple(BOOLS_OF_YAML_1_1)


def infer_parameter_type(value: Any) -> str | None:
    """Return the type of a value; `None` for an empty list and for lists of mixed types.

    Integers and doubles together are doubles.
    """
    if not isinstance(value, list):
        return _SCALARS.get(type(value))
    types = {_SCALARS.get(type(item)) for item in value}
    if types == {'integer', 'double'}:
        return 'double_array'
    only = types.pop() if len(types) == 1 else None
    return f'{only}_array' if only else None


def convert_parameter_value(value: Any, type_name: str | None) -> Any:
    """Return the value with integers converted to doubles where the type has doubles.

    A value that does not fit its type is returned unchanged.
    """
    if type_name == 'double' and type(value) is int:
        return float(value)
    if type_name == 'double_array' and isinstance(value, list):
        return [float(item) if type(item) is int else item for item in value]
    return value


def suggest_value(wanted: str | None, value: Any, text: str = '') -> str | None:
    """Return the help for a value that ROS reads as another type than is wanted.

    Args:
        text: The value as it is written.
    """
    got = infer_parameter_type(value)
    if (wanted, got) == ('double', 'integer'):
        return f'write {float(value)}'
    if (wanted, got) == ('double_array', 'integer_array'):
        return f'write {[float(item) for item in value]}'
    if wanted == 'string' and got in ('integer', 'double', 'bool'):
        return f"put it in quotes: '{text or value}'"
    return None


def find_type_problem(value: Any, type_name: str) -> str | None:
    """Return why a value is not of a parameter type, or `None` if it is."""
    return next((problem for _, problem in find_type_problems(value, type_name)), None)


def find_type_problems(value: Any, type_name: str) -> Iterator[tuple[tuple[int, ...], str]]:
    """Yield why a value is not of a parameter type; for an item, with its index."""
    item_type = type_name.removesuffix('_array')
    if item_type == type_name:
        if problem := _find_scalar_problem(value, type_name):
            yield (), problem
    elif not isinstance(value, list):
        yield (), f'expected a list of {item_type} values, got {value!r}'
    else:
        for index, item in enumerate(value):
            if problem := _find_item_problem(item, item_type):
                yield (index,), f'item {index}: {problem}'


def find_texts_for_bools(
    value: Any, path: DataPath, positions: SourceMap
) -> Iterator[tuple[DataPath, str, str]]:
    """Yield where `no`, `on` and the like stand without quotes, with a message and help.

    They are texts here and true in Python, and bools in ROS's parameter files. In a list with
    other texts they are meant as texts.
    """
    places = (
        {(*path, index): item for index, item in enumerate(value)}
        if isinstance(value, list)
        else {path: value}
    )
    if not all(isinstance(item, bool) or item in _WORDS for item in places.values()):
        return
    for at, item in places.items():
        span = positions.values.get(at)
        if span is not None and span.text == item:
            message = f"'{item}' is a text, not a bool, and true in Python"
            yield at, message, f"{suggest_bool(item)}, or '{item}' in quotes for the text"


def _find_item_problem(item: Any, item_type: str) -> str | None:
    problem = _find_scalar_problem(item, 'integer' if item_type == 'byte' else item_type)
    if problem is None and item_type == 'byte' and not 0 <= item <= _BYTE_MAX:
        return f'expected a byte (0 to {_BYTE_MAX}), got {item}'
    return problem


def _find_scalar_problem(value: Any, type_name: str) -> str | None:
    if _SCALARS.get(type(convert_parameter_value(value, type_name))) != type_name:
        return f'expected {with_article(type_name)}, got {value!r}'
    return _find_width_problem(value, type_name)


def _find_width_problem(value: Any, type_name: str) -> str | None:
    if type_name == 'integer' and not INT64_MIN <= value <= INT64_MAX:
        return f'{value} does not fit in 64 bits'
    return None
