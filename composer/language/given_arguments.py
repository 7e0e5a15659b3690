"""The values that an include gives the arguments of its file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.instances import ArgumentValues, sample_values
from composer.language.parameters import convert_parameter_value, find_type_fault
from composer.names import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.diagnostics import Span
    from composer.language.arguments import ArgumentSpec
    from composer.language.instances import Instance
    from composer.language.positions import DataPath


def give_arguments(
    declared: Mapping[str, ArgumentSpec],
    instance: Instance,
    at: DataPath,
    entry: dict[str, Any],
    faults: list[Diagnostic],
) -> ArgumentValues:
    """Return the values that an include gives."""
    given = entry.get('args', {})
    values = dict(sample_values(declared).values)
    origins: dict[str, str] = {}
    section = (*at, 'args')
    positions = instance.positions
    faults += [
        diagnostic_at(
            positions.key((*section, name)),
            'unknown-argument',
            f"'{entry['file']}' takes no argument '{name}'",
            help=did_you_mean(name, declared, 'it takes'),
        )
        for name in given
        if name not in declared
    ]
    unknown: list[str] = []
    for name, argument in declared.items():
        path = (*section, name)
        if name in given:
            value = convert_parameter_value(given[name], argument.type)
            fault = _find_fault(argument, value)
            if not fault:
                values[name] = value
                origins[name] = _origin(instance, path)
            elif positions.value(path) not in instance.sampled_spans:
                faults.append(diagnostic_at(positions.value(path), 'argument-type', fault))
            if fault or positions.value(path) in instance.sampled_spans:
                unknown.append(name)
        elif path in instance.dropped or section in instance.dropped:
            unknown.append(name)
        elif argument.default is None:
            unknown.append(name)
            faults.append(
                _missing_argument(argument, entry['file'], positions.value((*at, 'file')))
            )
    return ArgumentValues(values, unknown, origins)


def _origin(instance: Instance, path: DataPath) -> str:
    note = instance.notes.get(path)
    return instance.positions.value(path).place + (f', {note}' if note else '')


def _missing_argument(argument: ArgumentSpec, file: str, place: Span) -> Diagnostic:
    message = f"'{file}' wants the argument '{argument.name}'"
    return diagnostic_at(
        place, 'missing-argument', message, help=f"give it under 'args': {argument}"
    )


def _find_fault(argument: ArgumentSpec, value: Any) -> str | None:
    fault = find_type_fault(value, argument.type)
    if fault:
        return f"'{argument.name}': {fault}"
    if argument.choices and value not in argument.choices:
        choices = ', '.join(map(str, argument.choices))
        return f"'{argument.name}': {value!r} is none of {choices}"
    return None
