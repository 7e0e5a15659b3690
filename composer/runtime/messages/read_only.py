"""Write protection of the arrays of numbers in messages that several subscriptions share.

A fixed array is a NumPy array, which has a flag for that. An `array.array` has none: the message
becomes one of a class that shows it as a memoryview that cannot be written to. The other parts
of a message are written to as ever, which `composer check` finds.
"""

from __future__ import annotations

import copyreg
from array import array
from copy import copy
from functools import cache
from typing import TYPE_CHECKING, Any

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface
from composer.runtime.messages.arrays import is_number_array, is_numpy_array
from composer.runtime.messages.ownership import ownership_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.interfaces.descriptions import FieldType


@cache
def protector_for(message_class: type) -> Callable[[Any], None] | None:
    """Return what protects the arrays of numbers of a message; `None` if its class has none.

    It protects them in nested messages, too, and takes no time for the other fields.
    """
    fields = describe_class(message_class).fields
    steps = tuple(
        (f'_{field.name}', protect)
        for field in fields
        if (protect := _field_protector(field.type)) is not None
    )
    viewed = tuple(each.name for each in fields if _is_viewed(each.type))
    if not steps and not viewed:
        return None
    # Also of one that only has nested ones: copies begin at the outermost.
    protected_class = _create_class(message_class, viewed)

    def protect_fields(message: Any) -> None:
        message.__class__ = protected_class
        for name, protect in steps:
            protect(getattr(message, name))

    return protect_fields


def _is_viewed(field_type: FieldType) -> bool:
    return is_number_array(field_type) and not is_numpy_array(field_type)


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


def _create_class(message_class: type, viewed: tuple[str, ...]) -> type:
    """Return a class whose messages show some arrays as views; their copies are plain messages.

    It has the name of the message class, by which rclpy knows what to publish.
    """
    plain = ownership_of(message_class).copy

    def compare(message: Any, other: object) -> bool:
        return bool(plain(message) == (plain(other) if type(other) is type(message) else other))

    members = {
        '__slots__': (),
        '__module__': message_class.__module__,
        '__doc__': message_class.__doc__,
        # `type(message)()` is a message of one's own.
        '__new__': lambda _class, *values, **fields: message_class(*values, **fields),
        '__eq__': compare,
        '__hash__': None,
        '__repr__': lambda message: repr(plain(message)),
        '__reduce_ex__': lambda message, _protocol: (copy, (plain(message),)),
        # Its publishers take this in its place.
        'to_msg': plain,
        **{name: _view(message_class, name) for name in viewed},
    }
    return type(message_class)(message_class.__name__, (message_class,), members)


def _view(message_class: type, name: str) -> property:
    """Return a field that is read as a view, and assigned as ever."""
    field = f'_{name}'

    def read(message: Any) -> memoryview:
        return memoryview(getattr(message, field)).toreadonly()

    return property(read, getattr(message_class, name).fset)


def _reduce_view(view: memoryview) -> tuple[type, tuple[str, bytes]]:
    return array, (view.format, view.tobytes())


# `copy.deepcopy(message.data)` is an array that may be written to; Python has no copy of a view.
copyreg.pickle(memoryview, _reduce_view)
