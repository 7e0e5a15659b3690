"""Payloads of behaviours → messages that are safe to publish.

A *payload* is a message, a mapping of (nested) fields, or the bare value if the message has one
field. The same holds for the messages inside it. In detail:

- A mapping always names the fields of the message itself, even if there is only one; fields that
  it leaves out keep their defaults.
- An empty message is `{}` or None.
- An object with a method `to_msg()`, such as rclpy's `Time` and `Duration`, stands for its result.
- A message is checked and returned itself, not as a copy. Values in another form than rclpy wants
  (an `int` in a `float64` field, a tuple for a list) are replaced in place: rclpy 7 checks no
  fields unless `ROS_PYTHON_CHECK_FIELDS=1`, and publishes such an `int` as garbage.

`composer.interfaces.field_values` decides which values fit a field, `arrays` does so for arrays.
Both stop at the first error.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final

from composer.errors import ComposerError
from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface, is_message_class
from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_errors import (
    FieldError,
    format_field_error,
    no_message,
    unknown_field,
)
from composer.interfaces.field_values import Reader, scalar_reader
from composer.runtime.messages.arrays import array_reader
from composer.runtime.messages.ownership import ownership_of

# The types of most bare values, quickly distinguished from messages and mappings.
_SCALARS: Final = frozenset({str, int, float, bool})


class PayloadError(ComposerError):
    """A payload does not fit its message.

    Attributes:
        type_name: The full name of the message's type.
        path: The names and indices that lead to the wrong value, outermost first.
    """

    def __init__(self, type_name: str, error: FieldError) -> None:
        """Describe an error in a message of this type."""
        super().__init__(format_field_error(type_name, error.path, str(error)), help=error.help)
        self.type_name = type_name
        self.path = error.path


class _Unbuilt:
    """Stands for a message that nobody hears, and keeps none of its values."""

    __slots__ = ()

    def __setattr__(self, name: str, value: object) -> None:
        pass


class PayloadConverter:
    """Converts payloads to messages of one class; get it from `converter_for`."""

    __slots__ = (
        '_blank',
        '_defaults',
        '_readers',
        '_rules',
        '_single',
        '_slots',
        '_takes_bare_messages',
        'message_class',
        'type_name',
    )

    def __init__(self, message_class: type, *, builds: bool = True) -> None:
        """Compile the converter of a message class, and those of its nested messages.

        Args:
            builds: Whether mappings become messages; otherwise they are only checked.

        Raises:
            InterfaceNotFoundError: The class of a nested message cannot be loaded.
            UnsupportedFieldError: A field has a type that `.msg` files do not have.
        """
        description = describe_class(message_class)
        self.message_class = message_class
        self.type_name = description.name
        self._readers = {
            field.name: _reader_for(field.type, builds=builds) for field in description.fields
        }
        self._slots = {
            field.name: (f'_{field.name}', _type_that_fits(field.type), self._readers[field.name])
            for field in description.fields
        }
        self._rules = tuple(
            (field.name, _type_that_fits(field.type), self._readers[field.name])
            for field in description.fields
        )
        first = description.fields[0] if len(description.fields) == 1 else None
        ownership = ownership_of(message_class)
        self._blank: Callable[[], Any] = ownership.blank if builds else _Unbuilt
        self._defaults = ownership.defaults if builds else ()
        self._single = first.name if first else None
        self._takes_bare_messages = first is not None and first.type.kind == 'message'

    def convert(self, payload: object) -> Any:
        """Convert a payload to a message, or check the message that it is.

        Raises:
            PayloadError: The payload does not fit; the message names the first wrong field, its
                type and the value.
        """
        try:
            # The most frequent payload first.
            if type(payload) is self.message_class:
                return self._check(payload)
            return self.read(payload)
        except FieldError as error:
            raise PayloadError(self.type_name, error) from None

    def read(self, payload: object) -> object:
        """Convert a payload inside another one.

        Raises:
            FieldError: The payload does not fit; the path begins at this message.
        """
        kind = type(payload)
        if kind is self.message_class:
            return self._check(payload)
        if isinstance(payload, dict):
            return self._build(payload)
        if kind in _SCALARS and self._single is not None:
            return self._build({self._single: payload})
        return self._read_other(payload)

    def _read_other(self, payload: object) -> object:
        to_msg = getattr(type(payload), 'to_msg', None)
        value = to_msg(payload) if to_msg else payload
        if isinstance(value, self.message_class):
            return self._check(value)
        if isinstance(value, Mapping):
            return self._build(value)
        if value is None and not self._readers:
            return self.message_class()
        is_other = is_message_class(type(value)) and not self._takes_bare_messages
        if self._single is None or is_other:
            raise no_message(self.type_name, value, self._readers)
        return self._build({self._single: value})

    def _build(self, fields: Mapping[Any, object]) -> object:
        message, slots = self._blank(), self._slots
        for name, value in fields.items():
            if name not in slots:
                raise unknown_field(self.type_name, name, self._readers)
            slot, fits, read = slots[name]
            if type(value) is fits:
                setattr(message, slot, value)
                continue
            try:
                setattr(message, slot, read(value))
            except FieldError as error:
                error.within(name)
                raise
        if len(fields) < len(self._defaults):
            for name, slot, default, copy in self._defaults:
                if name not in fields:
                    setattr(message, slot, default if copy is None else copy(default))
        return message

    def _check(self, message: object) -> object:
        for name, fits, read in self._rules:
            value = getattr(message, name)
            if type(value) is fits:
                continue
            try:
                kept = read(value)
            except FieldError as error:
                error.within(name)
                raise
            if kept is not value:
                setattr(message, name, kept)
        return message


@cache
def converter_for(message_class: type, *, builds: bool = True) -> PayloadConverter:
    """Return the converter of a message class; it is compiled once.

    Args:
        builds: See `PayloadConverter`.

    Raises:
        InterfaceNotFoundError: The class of a nested message cannot be loaded.
        UnsupportedFieldError: A field has a type that `.msg` files do not have.
    """
    return PayloadConverter(message_class, builds=builds)


def _type_that_fits(field_type: FieldType) -> type | None:
    """Return the Python type whose values all fit a field as they are, if there is one."""
    if field_type.array is not None:
        return None
    return {'float64': float, 'bool': bool}.get(field_type.kind)


def _reader_for(field_type: FieldType, *, builds: bool) -> Reader:
    if field_type.nested is None:
        read_item = scalar_reader(field_type)
    else:
        read_item = converter_for(import_interface(field_type.nested), builds=builds).read
    return read_item if field_type.array is None else array_reader(field_type, read_item)
