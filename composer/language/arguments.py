"""What a file takes from the command line: declarations, and the words that give values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.errors import UsageError
from composer.language.parameters import (
    convert_parameter_value,
    find_type_fault,
    infer_parameter_type,
)
from composer.language.scalars import ScalarError, parse_plain_scalar
from composer.names import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_SEPARATOR = ':='
# What a file is checked with where a required argument has no value.
_SAMPLES: dict[str, Any] = {'bool': True, 'integer': 1, 'double': 1.0, 'string': 'sample'}


@dataclass(frozen=True, slots=True)
class ArgumentSpec:
    """An argument of a file.

    Attributes:
        type: `bool`, `integer`, `double` or `string`.
        default: `None` if a value is required.
        choices: The values that are allowed; none if all are.
    """

    name: str
    type: str
    default: Any = None
    description: str = ''
    choices: tuple[Any, ...] = ()

    @property
    def sample(self) -> Any:
        """A value to check the file with when none is given."""
        if self.default is not None:
            return self.default
        return self.choices[0] if self.choices else _SAMPLES[self.type]

    def __str__(self) -> str:
        """Return name, type, default and choices in one line."""
        text = f'{self.name} ({self.type}'
        if self.choices:
            text += f', one of {", ".join(map(str, self.choices))}'
        text += ', required)' if self.default is None else f', default {self.default})'
        return f'{text}: {self.description}' if self.description else text


def read_arguments(data: Mapping[str, Any]) -> dict[str, ArgumentSpec]:
    """Return the arguments that a file declares.

    Declarations that the schema refuses are read as far as they make sense: the schema reports
    them later, when the values have been put in.
    """
    declared = data.get('args')
    if not isinstance(declared, dict):
        return {}
    return {name: _read_argument(name, entry) for name, entry in declared.items()}


def _read_argument(name: str, data: Any) -> ArgumentSpec:
    entry = data if isinstance(data, dict) else {'default': data}
    default = entry.get('default')
    type_name = entry.get('type')
    if type_name not in _SAMPLES:
        type_name = infer_parameter_type(default)
    if type_name not in _SAMPLES:
        type_name = 'string'
    choices = entry.get('choices')
    return ArgumentSpec(
        name,
        type_name,
        convert_parameter_value(default, type_name),
        str(entry.get('description', '')),
        tuple(choices) if isinstance(choices, list) else (),
    )


def find_argument_faults(argument: ArgumentSpec) -> Iterator[str]:
    """Yield what is wrong with a declaration: a default or a choice that does not fit."""
    for value in (argument.default, *argument.choices):
        fault = None if value is None else find_type_fault(value, argument.type)
        if fault:
            yield fault
    default = argument.default
    if default is not None and argument.choices and default not in argument.choices:
        yield f'the default {default!r} is none of the choices'


def parse_arguments(declared: Mapping[str, ArgumentSpec], words: Sequence[str]) -> dict[str, Any]:
    """Return the values of a file's arguments.

    Args:
        words: `name:=value`, or values alone in the order of the declarations.

    Raises:
        UsageError: An argument is unknown, given twice, missing, or of the wrong type; all of
            these that there are.
    """
    faults: list[str] = []
    given: dict[str, str] = {}
    for name, text in _assign_words(declared, words, faults):
        if name not in declared:
            near = did_you_mean(name, declared)
            hint = f' ({near})' if near and near.startswith('did') else ''
            faults.append(f"there is no argument '{name}'{hint}")
        elif name in given:
            faults.append(f"'{name}' is given twice: {given[name]} and {text}")
        else:
            given[name] = text
    values = {name: argument.default for name, argument in declared.items()}
    for name, argument in declared.items():
        if name in given:
            values[name] = _parse_value(argument, given[name], faults)
        elif argument.default is None:
            faults.append(f"'{name}' is missing")
    if faults:
        raise UsageError('; '.join(faults), help=describe_arguments(declared))
    return values


def describe_arguments(declared: Mapping[str, ArgumentSpec]) -> str:
    """Return what a file declares, as the help of an error."""
    if not declared:
        return 'the file declares no arguments'
    return 'the file declares\n' + '\n'.join(f'    {argument}' for argument in declared.values())


def _assign_words(
    declared: Mapping[str, ArgumentSpec], words: Sequence[str], faults: list[str]
) -> Iterator[tuple[str, str]]:
    positions = iter(declared)
    for word in words:
        name, separator, text = word.partition(_SEPARATOR)
        if separator:
            yield name, text
        elif (position := next(positions, None)) is not None:
            yield position, word
        else:
            faults.append(f"'{word}' is one value too many")


def _parse_value(argument: ArgumentSpec, text: str, faults: list[str]) -> Any:
    value: Any = text
    if argument.type != 'string':
        try:
            value = convert_parameter_value(parse_plain_scalar(text), argument.type)
        except ScalarError:
            value = text
    fault = find_type_fault(value, argument.type)
    if fault:
        faults.append(f"'{argument.name}': {fault}")
    elif argument.choices and value not in argument.choices:
        options = ', '.join(map(str, argument.choices))
        faults.append(f"'{argument.name}': {value!r} is none of {options}")
    return value
