"""Parameters → files in ROS's own format, which rcl reads back as the same values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type
from composer.yaml_text.writer import RCL, render_key, render_yaml

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


def render_parameter_file(nodes: Mapping[str, Mapping[str, tuple[str, Any]]]) -> str:
    """Return a parameter file for nodes.

    Args:
        nodes: Type and value of each parameter, by its name, by the full name of its node.
    """
    parts = [part for name, values in nodes.items() for part in _render_node(name, values)]
    return ''.join(parts) or '# no node has parameters\n'


def render_parameters_for_all(parameters: Mapping[str, Any]) -> str:
    """Return a parameter file for all nodes of a process; integers among doubles are doubles."""
    return render_yaml({'/**': {'ros__parameters': _converted(dict(parameters))}}, RCL)


def _render_node(name: str, values: Mapping[str, tuple[str, Any]]) -> Iterator[str]:
    if not values:
        return
    reasons = {key: _why_unwritable(*typed) for key, typed in values.items()}
    yield f'{name}:\n'
    yield '  ros__parameters: {}\n' if all(reasons.values()) else '  ros__parameters:\n'
    for key, (_, value) in values.items():
        if reasons[key]:
            yield f'    # {render_key(key, RCL)}: {reasons[key]}\n'
        else:
            yield f'    {render_yaml({key: value}, RCL)}'


def _why_unwritable(type_name: str, value: Any) -> str | None:
    if type_name == 'byte_array':
        return 'parameter files have no byte type'
    return 'an empty list has no type in a parameter file' if value == [] else None


def _converted(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _converted(each) for name, each in value.items()}
    return convert_parameter_value(value, infer_parameter_type(value))
