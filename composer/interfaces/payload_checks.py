"""Check plain data against the description of a message, and find all that is wrong with it.

The verdict is that of the conversion at run time (`composer.runtime.messages.payloads`): both
apply the rules of `composer.interfaces.field_values`. This one needs no message class, so it works
without ROS.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import format_fault
from composer.interfaces.field_values import (
    FieldError,
    FieldRule,
    check_length,
    no_message,
    read_items,
    scalar_reader,
    unknown_field,
)


@dataclass(frozen=True, slots=True)
class FieldFault:
    """One thing that is wrong with the data of a message.

    Attributes:
        path: keys and indices that lead to it in the data; for an unknown field the key itself is
            the last of them.
        message: the type of the message, the field, what was expected and what was found.
        help: what to do about it, where that is known.
        rule: which rule is broken.
    """

    path: tuple[str | int, ...]
    message: str
    help: str | None
    rule: FieldRule


def find_payload_faults(
    description: MessageDescription,
    data: object,
    catalogue: InterfaceCatalogue,
) -> Iterator[FieldFault]:
    """Find everything for which data could not become a message.

    Args:
        description: of the message.
        data: a payload of mappings, lists and scalars, as YAML has them.
        catalogue: describes nested messages; what it does not know is taken as right.
    """
    yield from _Walk(description.name, catalogue).message(description, data, _Place())


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the walk is, in the data and in the message, which names the fields of bare values."""

    data: tuple[str | int, ...] = ()
    fields: tuple[str | int, ...] = ()

    def under(self, key: str | int) -> '_Place':
        return _Place((*self.data, key), (*self.fields, key))

    def bare(self, field: str) -> '_Place':
        return _Place(self.data, (*self.fields, field))


@dataclass(frozen=True, slots=True)
class _Walk:
    root: str
    catalogue: InterfaceCatalogue

    def message(
        self,
        description: MessageDescription,
        data: object,
        place: _Place,
    ) -> Iterator[FieldFault]:
        names = [field.name for field in description.fields]
        if isinstance(data, Mapping):
            for key, value in data.items():
                field = description.field(key)
                if field is None:
                    error = unknown_field(description.name, key, names)
                    yield self.fault(error, _Place((*place.data, key), place.fields))
                else:
                    yield from self.field(field.type, value, place.under(key))
        elif len(names) == 1:
            yield from self.field(description.fields[0].type, data, place.bare(names[0]))
        elif data is not None or names:
            yield self.fault(no_message(description.name, data, names), place)

    def field(self, field_type: FieldType, data: object, place: _Place) -> Iterator[FieldFault]:
        if field_type.array is None:
            yield from self.item(field_type, data, place)
            return
        try:
            items = read_items(field_type, data)
        except FieldError as error:
            yield self.fault(error, place)
            return
        try:
            check_length(field_type, len(items))
        except FieldError as error:
            yield self.fault(error, place)
        for index, item in enumerate(items):
            yield from self.item(field_type.item, item, place.under(index))

    def item(self, field_type: FieldType, data: object, place: _Place) -> Iterator[FieldFault]:
        if field_type.nested is None:
            try:
                scalar_reader(field_type)(data)
            except FieldError as error:
                yield self.fault(error, place)
            return
        nested = self.catalogue.describe(field_type.nested)
        if isinstance(nested, MessageDescription):
            yield from self.message(nested, data, place)

    def fault(self, error: FieldError, place: _Place) -> FieldFault:
        message = format_fault(self.root, place.fields, str(error))
        return FieldFault(place.data, message, error.help, error.rule)
