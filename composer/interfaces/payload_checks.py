"""Check plain data against the description of a message, and report all errors.

It finds what the conversion at run time (`composer.runtime.messages.payloads`) refuses: both apply
the rules of `composer.interfaces.field_values`. It needs no message class, and no ROS.
"""

from collections.abc import Iterator, Mapping

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import (
    FieldError,
    FieldRule,
    format_field_error,
    no_message,
    unknown_field,
)
from composer.interfaces.field_values import check_length, read_items, scalar_reader
from composer.records import record


@record
class FieldFinding:
    """One error in the data of a message.

    Attributes:
        path: keys and indices that lead to the error in the data; those of an unknown field end
            with its key.
        message: the type of the message, the field, what was expected and what was found.
        help: what to do about it, if that is known.
        rule: the rule that the data break.
    """

    path: tuple[str | int, ...]
    message: str
    help: str | None
    rule: FieldRule


def check_payload(
    description: MessageDescription,
    data: object,
    catalogue: InterfaceCatalogue,
) -> Iterator[FieldFinding]:
    """Yield an error for each value that keeps data from becoming a message.

    Args:
        description: of the message.
        data: a payload of mappings, lists and scalars, as YAML has them.
        catalogue: describes nested messages; those that it does not know are not checked.
    """
    yield from _Walk(description.name, catalogue).message(description, data, _Place())


@record
class _Place:
    """A place in the data and in the message, which has a name for the field of a bare value."""

    data: tuple[str | int, ...] = ()
    fields: tuple[str | int, ...] = ()

    def under(self, key: str | int) -> '_Place':
        return _Place((*self.data, key), (*self.fields, key))

    def bare(self, field: str) -> '_Place':
        return _Place(self.data, (*self.fields, field))


@record
class _Walk:
    root: str
    catalogue: InterfaceCatalogue

    def message(
        self,
        description: MessageDescription,
        data: object,
        place: _Place,
    ) -> Iterator[FieldFinding]:
        names = [field.name for field in description.fields]
        if isinstance(data, Mapping):
            for key, value in data.items():
                field = description.field(key)
                if field is None:
                    error = unknown_field(description.name, key, names)
                    yield self.finding(error, _Place((*place.data, key), place.fields))
                else:
                    yield from self.field(field.type, value, place.under(key))
        elif len(names) == 1:
            yield from self.field(description.fields[0].type, data, place.bare(names[0]))
        elif data is not None or names:
            yield self.finding(no_message(description.name, data, names), place)

    def field(self, field_type: FieldType, data: object, place: _Place) -> Iterator[FieldFinding]:
        if field_type.array is None:
            yield from self.item(field_type, data, place)
            return
        try:
            items = read_items(field_type, data)
        except FieldError as error:
            yield self.finding(error, place)
            return
        try:
            check_length(field_type, len(items))
        except FieldError as error:
            yield self.finding(error, place)
        for index, item in enumerate(items):
            yield from self.item(field_type.item, item, place.under(index))

    def item(self, field_type: FieldType, data: object, place: _Place) -> Iterator[FieldFinding]:
        if field_type.nested is None:
            try:
                scalar_reader(field_type)(data)
            except FieldError as error:
                yield self.finding(error, place)
            return
        nested = self.catalogue.describe(field_type.nested)
        if isinstance(nested, MessageDescription):
            yield from self.message(nested, data, place)

    def finding(self, error: FieldError, place: _Place) -> FieldFinding:
        message = format_field_error(self.root, place.fields, str(error))
        return FieldFinding(place.data, message, error.help, error.rule)
