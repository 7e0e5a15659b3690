"""Declarations of parameters: types, ranges, choices and defaults."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.ros_parameters.parameter_types import (
    find_texts_for_bools,
    find_type_problem,
    find_type_problems,
)
from composer.spelling import suggest
from composer.yaml_text.scalars import suggest_bool

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ParameterSpec
    from composer.yaml_text.positions import DataPath

_RULE = 'bad-parameter'
_NUMERIC = ('integer', 'double')
_LIMITS = ('minimum', 'maximum', 'step')
_HAS_CHOICES = (*_NUMERIC, 'string')

# Parameters that each node of rclpy declares itself, and what to say of them.
OF_EVERY_NODE = {
    'use_sim_time': (
        'a key of the node, not one of its parameters',
        "move it out of 'parameters:'",
    ),
    'start_type_description_service': (
        'declared by every node of ROS itself',
        "write 'type_description_service:' in the node, which sets it",
    ),
}

# With this relative tolerance rclpy compares doubles (`Node._apply_floating_point_range`).
_STEP_TOLERANCE = 1e-6


def check_parameters(context: CheckContext) -> Iterator[Diagnostic]:
    """Check each declaration against itself."""
    for process in context.spec.processes.values():
        for declared in process.nodes:
            for name, parameter in declared.parameters.items():
                if name not in OF_EVERY_NODE:
                    yield from _check_parameter(context, parameter)
    for node in context.spec.nodes.values():
        for parameter in node.parameters.values():
            yield from _check_parameter(context, parameter)
        if node.on_parameters is not None and not node.parameter_services:
            yield context.at_key(
                (*node.path, 'on_parameters'),
                'unreachable-parameters',
                f"node '{node.name}' has no parameter services: 'on_parameters' is only called "
                'for changes by its own behaviours',
                help="write 'parameter_services: true' in the node, or remove 'on_parameters'",
            )


def _check_parameter(context: CheckContext, parameter: ParameterSpec) -> Iterator[Diagnostic]:
    path = _value_path(context, parameter)
    if parameter.name in OF_EVERY_NODE:
        what, help_text = OF_EVERY_NODE[parameter.name]
        message = f"'{parameter.name}' is {what}"
        yield context.at_key(parameter.path, _RULE, message, help=help_text)
        return
    if parameter.type is None:
        yield context.at_value(
            path,
            _RULE,
            'cannot tell the type of this list',
            help='write {default: [], type: string_array}, with the type that is meant',
        )
        return
    value = parameter.value
    problems = [] if value is None else list(find_type_problems(value, parameter.type))
    for item, problem in problems:
        wrong = value[item[0]] if item else value
        yield context.at_value(
            (*path, *item),
            _RULE,
            f"parameter '{parameter.name}': {problem}",
            help=suggest_bool(wrong) if parameter.type.startswith('bool') else None,
        )
    if problems:
        return
    if parameter.choices is None and not _has_type(context, parameter):
        yield from warn_of_texts_for_bools(context, value, path)
    limits = list(_check_limits(context, parameter))
    yield from limits
    if not limits and parameter.value is not None:
        refusal = find_refusal(parameter, parameter.value)
        if refusal:
            near = find_nearest_choice(parameter, parameter.value)
            message = f"parameter '{parameter.name}': {refusal}"
            yield context.at_value(path, _RULE, message, help=near)


def warn_of_texts_for_bools(
    context: CheckContext, value: Any, path: DataPath
) -> Iterator[Diagnostic]:
    """Warn of words that ROS's parameter files have for bools."""
    for at, message, advice in find_texts_for_bools(value, path, context.system.positions):
        yield context.at_value(at, 'text-for-bool', message, help=advice)


def _has_type(context: CheckContext, parameter: ParameterSpec) -> bool:
    return (*parameter.path, 'type') in context.system.positions.values


def _value_path(context: CheckContext, parameter: ParameterSpec) -> DataPath:
    inner = (*parameter.path, 'default')
    return inner if inner in context.system.positions.values else parameter.path


def _check_limits(context: CheckContext, parameter: ParameterSpec) -> Iterator[Diagnostic]:
    assert parameter.type is not None  # noqa: S101 - told by the caller, for the type checker
    limits = [key for key in _LIMITS if getattr(parameter, key) is not None]
    inferred = not _has_type(context, parameter)
    if limits and inferred and parameter.type not in _NUMERIC:
        yield context.at_value(
            (*parameter.path, 'default'),
            _RULE,
            f"parameter '{parameter.name}': expected an integer or a double, "
            f"which '{limits[0]}' is for, got {parameter.value!r}",
        )
        return
    are_doubles = all(type(getattr(parameter, key)) is float for key in limits)
    if inferred and parameter.type == 'integer' and are_doubles and len(limits) > 1:
        message = f"parameter '{parameter.name}': expected a double, as its limits are"
        path, help_text = (*parameter.path, 'default'), f'write {parameter.value}.0'
        yield context.at_value(path, _RULE, message, help=help_text)
        return
    for key in limits:
        limit = getattr(parameter, key)
        path = (*parameter.path, key)
        if parameter.type not in _NUMERIC:
            message = f"'{key}' is for integers and doubles, and this is a {parameter.type}"
            yield context.at_key(path, _RULE, message)
        elif problem := find_type_problem(limit, parameter.type):
            yield context.at_value(path, _RULE, f"'{key}': {problem}")
    low, high = parameter.minimum, parameter.maximum
    if low is not None and high is not None and low > high:
        path = (*parameter.path, 'maximum')
        yield context.at_value(path, _RULE, f'the maximum {high} is below the minimum {low}')
    if parameter.step is not None and (low is None or high is None):
        message = "'step' requires 'minimum' and 'maximum'"
        yield context.at_key((*parameter.path, 'step'), _RULE, message)
    yield from _check_choices(context, parameter)


def _check_choices(context: CheckContext, parameter: ParameterSpec) -> Iterator[Diagnostic]:
    if parameter.choices is None or parameter.type is None:
        return
    path = (*parameter.path, 'choices')
    if parameter.type not in _HAS_CHOICES:
        message = f'choices are for integers, doubles and strings, and this is a {parameter.type}'
        yield context.at_key(path, _RULE, message)
        return
    problems = {
        index: problem
        for index, choice in enumerate(parameter.choices)
        if (problem := find_type_problem(choice, parameter.type))
    }
    if len(problems) == len(parameter.choices) and parameter.value is not None:
        # None is of the type of the value, so it is the value that is odd.
        refusal = find_refusal(parameter, parameter.value)
        at = (*parameter.path, 'default')
        yield context.at_value(at, _RULE, f"parameter '{parameter.name}': {refusal}")
        return
    for index, problem in problems.items():
        yield context.at_value((*path, index), _RULE, f'choice {index}: {problem}')


def find_nearest_choice(parameter: ParameterSpec, value: Any) -> str | None:
    """Return the help for a text that is not one of the choices, but near one, or no bool."""
    near = suggest(value, parameter.choices or ())
    return suggest_bool(value) if parameter.type == 'bool' else near


def find_refusal(parameter: ParameterSpec, value: Any) -> str | None:
    """Return why a value of the right type would be refused, or `None`."""
    if parameter.choices is not None and value not in parameter.choices:
        return f'{value!r} is not one of its choices: {", ".join(map(str, parameter.choices))}'
    if parameter.type not in _NUMERIC:
        return None
    low, high, step = parameter.minimum, parameter.maximum, parameter.step
    if low is not None and not value >= low:
        return f'{value} is below the minimum {low}'
    if high is not None and not value <= high:
        return f'{value} is above the maximum {high}'
    if step is None or low is None or value == high:
        return None
    steps = (value - low) / step
    if abs(steps - round(steps)) > _STEP_TOLERANCE * max(1.0, abs(steps)):
        return f'{value} is not minimum + n * step ({low} + n * {step})'
    return None
