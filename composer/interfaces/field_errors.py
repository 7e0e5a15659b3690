"""Errors of single fields, and how their messages show values and paths."""

from collections.abc import Iterable
from reprlib import Repr
from typing import Final, Literal, TypeAlias

from composer.errors import ComposerError
from composer.interfaces.classes import interface_name, is_message_class
from composer.interfaces.descriptions import FieldType
from composer.spelling import did_you_mean, suggest

FieldRule: TypeAlias = Literal[
    'unknown-field',
    'field-type',
    'field-range',
    'field-length',
    'field-text',
]

# No field holds a longer integer, and Python may refuse to print its digits
# (`sys.set_int_max_str_digits`).
LONG_INTEGER_BITS: Final = 128
_SHORT: Final = Repr()
_SHORT.maxstring = _SHORT.maxother = 60


# What behaviours write that have a goal handle in rclpy.
_OF_GOAL_HANDLES: Final = {
    'abort': 'raise composer.AbortedError',
    'canceled': 'return the result: the goal is canceled if that was asked for',
    'is_cancel_requested': 'yield: a cancel request closes the generator there',
    'publish_feedback': 'yield the feedback',
    'request': 'this is the request',
    'succeed': 'return the result',
}


class FieldError(ComposerError):
    """A field cannot hold a value.

    Attributes:
        rule: the rule that the value breaks.
        path: names and indices that lead to the value, outermost first; `within` adds to it while
            the error propagates.
    """

    def __init__(
        self,
        message: str,
        *,
        rule: FieldRule,
        help: str | None = None,  # noqa: A002
    ) -> None:
        """Store the rule; the message has what was expected and what was found."""
        super().__init__(message, help=help)
        self.rule = rule
        self.path: tuple[str | int, ...] = ()

    def within(self, key: str | int) -> 'FieldError':
        """Add a name or an index in front of the path."""
        self.path = (key, *self.path)
        return self


def unknown_field(
    message_name: str, key: object, names: Iterable[str], meant: str | None = None
) -> FieldError:
    """Return the error for a key that is no field of its message."""
    names = tuple(names)
    advice = did_you_mean(meant, suggest(key, names))
    if message_name.endswith('.Goal') and key in _OF_GOAL_HANDLES:
        advice = f'{_OF_GOAL_HANDLES[str(key)]};'
    fields = f'its fields are {", ".join(names)}' if names else 'it has no fields'
    return FieldError(
        f'{message_name} has no field {key!r}',
        rule='unknown-field',
        help=f'{advice} {fields}' if advice else fields,
    )


def no_message(message_name: str, value: object, names: Iterable[str]) -> FieldError:
    """Return the error for a value that cannot become a message."""
    fields = ', '.join(names)
    if value == 'now':
        fields += "; only a behaviour knows the time, as in {'stamp': node.now()}"
    return FieldError(
        f'expected {message_name}, got {describe_value(value)}',
        rule='field-type',
        help=f'give its fields by name: {fields}' if fields else 'it has no fields: write {}',
    )


def wrong_type(expected: FieldType, value: object, advice: str | None = None) -> FieldError:
    """Return the error for a value of a wrong type."""
    message = f'expected {expected}, got {describe_value(value)}'
    return FieldError(message, rule='field-type', help=advice)


def describe_value(value: object) -> str:
    """Describe a value in a few words: its type, and the value if it is short."""
    if value is None:
        return 'None'
    if is_message_class(type(value)):
        return interface_name(type(value))
    if isinstance(value, int) and value.bit_length() > LONG_INTEGER_BITS:
        return f'an integer of {value.bit_length()} bits'
    dtype, shape = getattr(value, 'dtype', None), getattr(value, 'shape', ())
    if dtype is not None and shape:
        return f'{type(value).__name__} of {dtype}, shape {shape}'
    return f'{type(value).__name__} {_SHORT.repr(value)}'


def format_path(path: Iterable[str | int]) -> str:
    """Write a path as code would: `points[3].y`."""
    text = ''
    for key in path:
        if isinstance(key, int):
            text += f'[{key}]'
        else:
            text += f'.{key}' if text else key
    return text


def format_field_error(message_name: str, path: tuple[str | int, ...], error: str) -> str:
    """Return an error with its place; one of the message itself names the message already."""
    return f'{message_name}: {format_path(path)}: {error}' if path else error
