"""The arguments of a file: how they are declared, and what gives them their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.errors import UsageError
from composer.expressions import is_argument_name
from composer.language.values.start_values import SOURCE_KEYS, SOURCES
from composer.records import record
from composer.ros_parameters.parameter_types import (
    convert_parameter_value,
    find_type_problem,
    infer_parameter_type,
)
from composer.spelling import suggest
from composer.terminal import escape
from composer.yaml_text.scalars import ScalarError, parse_plain_scalar, suggest_bool

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence


_SEPARATOR = ':='
# What a file is checked with where a required argument has no value.
_SAMPLES: dict[str, Any] = {'bool': True, 'integer': 1, 'double': 1.0, 'string': 'sample'}
ARGUMENT_TYPES = tuple(_SAMPLES)


@record
class StartDefault:
    """A default that is read when the system starts.

    Attributes:
        data: Where it is from, as the file says it.
    """

    data: Mapping[str, Any]

    def __str__(self) -> str:
        """Return where it is from in words."""
        command, key = self.data.get('command'), self.data.get('key')
        if isinstance(command, list):
            return f"what '{' '.join(map(str, command))}' prints"
        return f"'{key}' in {self.data['file']}" if key else f'the text of {self.data["file"]}'


@record
class ArgumentSpec:
    """An argument of a file.

    Attributes:
        type: `bool`, `integer`, `double` or `string`; empty if only a computed default tells it.
        default: `None` if a value is required; a text with expressions, or where it is read
            when the system starts, if it is computed.
        choices: The values that are allowed; none if all are.
    """

    name: str
    type: str
    default: Any = None
    description: str = ''
    choices: tuple[Any, ...] = ()

    @property
    def is_open(self) -> bool:
        """Whether nothing in the file says what the value may be."""
        return self.default is None and not self.choices

    @property
    def is_computed(self) -> bool:
        """Whether the default is computed from other values."""
        is_text = isinstance(self.default, str) and '{{' in self.default
        return is_text or isinstance(self.default, StartDefault)

    @property
    def sample(self) -> Any:
        """A value to check the file with when none is given."""
        if self.default is not None and not self.is_computed:
            return self.default
        return self.choices[0] if self.choices else _SAMPLES[self.type or 'string']

    def __str__(self) -> str:
        """Return name, type, default and choices in one line."""
        text = f'{self.name} ({self.type}'
        if self.choices:
            text += f', one of {_listed(self.choices)}'
        text += ', required)' if self.default is None else f', default {_shown(self.default)})'
        return f'{text}: {escape(self.description)}' if self.description else text


@record
class ArgumentValues:
    """The values of a file's arguments.

    Those with a computed default are missing unless they are given.

    Attributes:
        samples: The names of those whose value is a sample of its type.
        origins: Where they come from, in words; those that have their default are not in it.
    """

    values: Mapping[str, Any]
    samples: Collection[str] = ()
    origins: Mapping[str, str] = field(default_factory=dict)


GiveValues: TypeAlias = Callable[[Mapping[str, ArgumentSpec]], ArgumentValues]


def sample_values(declared: Mapping[str, ArgumentSpec]) -> ArgumentValues:
    """Return values to check a file with: defaults, and samples where there are none."""
    return ArgumentValues(
        {
            name: argument.sample
            for name, argument in declared.items()
            if not argument.is_computed or _is_unknown(argument)
        },
        {name for name, argument in declared.items() if _is_unknown(argument)},
    )


def _is_unknown(argument: ArgumentSpec) -> bool:
    """Return whether the declaration gives no value, or a wrong one."""
    is_wrong = isinstance(argument.default, list | dict) or any(find_declaration_errors(argument))
    return argument.is_open or is_wrong


def values_from_words(
    declared: Mapping[str, ArgumentSpec], words: Sequence[str] | None
) -> ArgumentValues:
    """Return the values that a command line gives; samples if there is no command line.

    Raises:
        UsageError: The words do not fit the declarations.
    """
    if words is None:
        return sample_values(declared)
    values, given = parse_arguments(declared, words)
    return ArgumentValues(values, origins=dict.fromkeys(given, 'command line'))


def parse_declarations(data: Mapping[str, Any]) -> dict[str, ArgumentSpec]:
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
    if not entry.keys().isdisjoint(SOURCES):
        default = StartDefault({k: entry[k] for k in SOURCE_KEYS if k in entry})
    type_name = entry.get('type')
    if type_name not in ARGUMENT_TYPES:
        is_computed = isinstance(default, str) and '{{' in default
        type_name = '' if is_computed else infer_parameter_type(default)
    if type_name not in (*ARGUMENT_TYPES, ''):
        type_name = 'string'
    choices = entry.get('choices')
    return ArgumentSpec(
        name,
        type_name,
        convert_parameter_value(default, type_name),
        str(entry.get('description', '')),
        tuple(choices) if isinstance(choices, list) else (),
    )


def find_declaration_errors(
    argument: ArgumentSpec,
) -> Iterator[tuple[tuple[str | int, ...], str, str | None]]:
    """Yield the errors of a declaration that the schema does not find, with their keys and help.

    A name that no expression can use, and a default or a choice that does not fit.
    """
    if not is_argument_name(argument.name):
        yield (), f"'{argument.name}' cannot be used as a name in expressions", None
    choices = argument.choices
    default = None if argument.is_computed else argument.default
    places: list[tuple[tuple[str | int, ...], Any]] = [(('default',), default)]
    places += [(('choices', index), choice) for index, choice in enumerate(choices)]
    for keys, value in places:
        is_computed = argument.is_computed and value == argument.default
        problem = None if is_computed else _find_default_problem(value, argument.type)
        if value is not None and problem:
            yield keys, problem, find_help(argument, value)
    if default is not None and choices and default not in choices:
        message = f'the default {default!r} is not one of the choices'
        yield ('default',), message, find_help(argument, default)


def _find_default_problem(value: Any, type_name: str) -> str | None:
    if isinstance(value, list | dict):
        return None  # the schema says so
    if isinstance(value, str) and '{{' in value:
        return 'a choice cannot be an expression'
    return find_type_problem(value, type_name) if type_name else None


def parse_arguments(
    declared: Mapping[str, ArgumentSpec], words: Sequence[str]
) -> tuple[dict[str, Any], list[str]]:
    """Return the values of a file's arguments, and the names of those that the words give.

    Args:
        words: `name:=value`, or values alone in the order of the declarations.

    Raises:
        UsageError: An argument is unknown, given twice, missing, or of the wrong type; all of
            these that there are.
    """
    problems: list[str] = []
    given: dict[str, str] = {}
    for name, text in _assign_words(declared, words, problems):
        if name not in declared:
            advice = suggest(name, declared)
            hint = f' ({advice})' if advice else ''
            problems.append(f"there is no argument '{name}'{hint}")
        elif name in given:
            problems.append(f"'{name}' is given twice: {given[name]!r} and {text!r}")
        else:
            given[name] = text
    values = {name: each.default for name, each in declared.items() if not each.is_computed}
    for name, argument in declared.items():
        if name in given:
            values[name] = _parse_value(argument, given[name], problems)
        elif argument.default is None:
            problems.append(f"'{name}' is missing")
    if problems:
        raise UsageError('; '.join(problems), help=describe_arguments(declared))
    return values, list(given)


def describe_arguments(declared: Mapping[str, ArgumentSpec]) -> str:
    """Return the arguments that a file declares, as the help of an error."""
    if not declared:
        return 'the file declares no arguments'
    return 'the file declares\n' + '\n'.join(f'  {argument}' for argument in declared.values())


def _assign_words(
    declared: Mapping[str, ArgumentSpec], words: Sequence[str], problems: list[str]
) -> Iterator[tuple[str, str]]:
    positions = iter(declared)
    for word in words:
        name, separator, text = word.partition(_SEPARATOR)
        if separator:
            yield name, text
        elif (given := word.partition('='))[0] in declared:
            problems.append(f"write '{given[0]}:={given[2]}', not '{word}'")
            yield given[0], given[2]
        elif (position := next(positions, None)) is not None:
            yield position, word
        else:
            problems.append(f"'{word}' is one argument too many")


def _parse_value(argument: ArgumentSpec, text: str, problems: list[str]) -> Any:
    value: Any = text if argument.type == 'string' else _parse_text(text, argument.type)
    problem = find_value_problem(argument, value)
    advice = suggest_bool(value) if argument.type == 'bool' else None
    problems += [f'{problem} ({advice})' if advice else problem] if problem else []
    return value


def find_value_problem(argument: ArgumentSpec, value: Any) -> str | None:
    """Return what is wrong with a value for an argument, if anything."""
    problem = find_type_problem(value, argument.type)
    if not problem and argument.choices and value not in argument.choices:
        problem = f'{value!r} is not one of {_listed(argument.choices)}'
    return problem and f"'{argument.name}': {problem}"


def find_help(argument: ArgumentSpec, value: Any) -> str | None:
    """Return the help for a wrong value of an argument."""
    if argument.type == 'bool':
        return suggest_bool(value)
    # Why there is one choice is in the description.
    only = argument.description if len(argument.choices) == 1 else ''
    return only or suggest(value, argument.choices)


def _parse_text(text: str, type_name: str) -> Any:
    """Return a text as a YAML scalar; the text itself if it is none."""
    try:
        value = parse_plain_scalar(text)
    except ScalarError:
        return text
    return text if value is None else convert_parameter_value(value, type_name)


def _listed(values: Sequence[Any]) -> str:
    return ', '.join(map(_shown, values))


def _shown(value: Any) -> str:
    """Return a value as it is written, in quotes where a reader could miss it."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, str) and (not value or value != value.strip() or not value.isprintable()):
        return repr(value)
    return str(value)
