"""Write protection of the NumPy arrays in messages that several subscriptions share.

Only fixed arrays of numbers are NumPy arrays, and only these can be protected: the other parts of
a message are written to as ever, which `composer check` finds.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface
from composer.runtime.messages.arrays import is_numpy_array

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.interfaces.descriptions import FieldType


@cache
def protector_for(message_class: type) -> Callable[[Any], None] | None:
    """Return what protects the NumPy arrays of a message; `None` if its class has none.

    It protects them in nested messages, too, and takes no time for the other fields.
    """
    steps = tuple(
        (f'_{field.name}', protect)
        for field in describe_class(message_class).fields
        if (protect := _field_protector(field.type)) is not None
    )
    if not steps:
        return None

    def protect_fields(message: Any) -> None:
        for name, protect in steps:
            protect(getattr(message, name))

    return protect_fields


def _field_protector(field_type: FieldType) -> Callable[[Any], None] | None:
    if is_numpy_array(field_type):
        return _protect_array
    if field_type.nested is None:
        return None
    protect_item = protector_for(import_interface(field_type.nested))
    if protect_item is None or field_type.array is None:
        return protect_item

    def protect_items(messages: Any) -> None:
        for each in messages:
            protect_item(each)

    return protect_items


def _protect_array(values: Any) -> None:
    values.flags.writeable = False
