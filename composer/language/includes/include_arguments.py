"""The values that an include gives the arguments of its file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.arguments import (
    ArgumentValues,
    find_help,
    find_value_problem,
    sample_values,
)
from composer.ros_parameters.parameter_types import convert_parameter_value
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.language.arguments import ArgumentSpec
    from composer.language.includes.include_entry import IncludeEntry
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath


def values_from_include(
    declared: Mapping[str, ArgumentSpec], place: IncludeEntry
) -> ArgumentValues:
    """Return the values that an include gives; errors in them are added to its file."""
    findings = place.system.diagnostics
    given = place.data.get('args', {})
    values = dict(sample_values(declared).values)
    origins: dict[str, str] = {}
    section = (*place.at, 'args')
    findings += _find_unknown(declared, given, place)
    unknown: list[str] = []
    for name, argument in declared.items():
        path = (*section, name)
        if name in given:
            value = convert_parameter_value(given[name], argument.type)
            problem = find_value_problem(argument, value)
            if not problem:
                values[name] = value
                origins[name] = _origin(place.system, path)
            elif not place.is_open(path):
                span = place.system.positions.value(path)
                near = find_help(argument, value)
                findings.append(diagnostic_at(span, 'argument-type', problem, help=near))
            if problem or place.is_open(path):
                unknown.append(name)
        elif not place.system.dropped.isdisjoint((path, section)):
            unknown.append(name)
        elif argument.default is None:
            unknown.append(name)
            findings.append(_missing_argument(argument, place))
    return ArgumentValues(values, unknown, origins)


def _find_unknown(
    declared: Mapping[str, ArgumentSpec], given: Mapping[str, Any], place: IncludeEntry
) -> Iterator[Diagnostic]:
    for name in [each for each in given if each not in declared]:
        yield diagnostic_at(
            place.system.positions.key((*place.at, 'args', name)),
            'unknown-argument',
            f"'{place.file}' takes no argument '{name}'",
            help=suggest(name, declared, 'it takes'),
        )


def _origin(system: LoadedSystem, path: DataPath) -> str:
    note = system.notes.get(path)
    return system.positions.value(path).place + (f', {note}' if note else '')


def _missing_argument(argument: ArgumentSpec, place: IncludeEntry) -> Diagnostic:
    message = f"'{place.file}' needs the argument '{argument.name}'"
    help_text = f"give it under 'args': {argument}"
    return diagnostic_at(place.span, 'missing-argument', message, help=help_text)
