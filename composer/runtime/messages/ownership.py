"""Messages that belong to nobody else, for subscriptions that get them without the middleware.

What the publisher has let go of is moved. What it still refers to (in its state, in a closure, as
a view of an array) is copied, as deep as needed: CPython's reference counts tell. Values become
what they would be after the middleware: the numbers of `float32` are rounded.
"""

from __future__ import annotations

import struct
from array import array
from functools import cache
from sys import getrefcount
from typing import TYPE_CHECKING, Any, Final
from weakref import getweakrefcount

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.interfaces.descriptions import FieldType

_FLOAT32: Final = struct.Struct('f')


def _refcount_in(value: Any) -> int:
    """Return the references to what a caller holds in one variable, and nobody else has."""
    return getrefcount(value)


def _count_of_one() -> int:
    value = [None]
    holder = [value]
    value = holder[0]
    return _refcount_in(value)


# The references to a value in one field, which is in a variable of the caller, as the called
# function counts them. Versions of Python differ.
_IN_A_FIELD: Final = _count_of_one()


class Ownership:
    """How messages of one class are copied and moved; get it from `ownership_of`.

    Attributes:
        defaults: The name of each field, that of its slot, its default, and what copies that;
            `None` if it cannot change.
    """

    __slots__ = ('_class', '_copiers', '_movers', '_other_values', '_others', 'defaults')

    def __init__(self, message_class: type) -> None:
        fields = describe_class(message_class).fields
        self._class = message_class
        known = {f'_{each.name}': each.type for each in fields}
        self._others = tuple(each for each in message_class.__slots__ if each not in known)  # type: ignore[attr-defined]
        self._copiers = tuple((name, _copier_for(each)) for name, each in known.items())
        default = message_class()
        self._other_values = tuple((each, getattr(default, each)) for each in self._others)
        self.defaults = tuple(
            (name[1:], name, getattr(default, name), copier) for name, copier in self._copiers
        )
        self._movers = tuple(
            (name, mover) for name, each in known.items() if (mover := _mover_for(each))
        )

    def take(self, message: Any, *, is_held: bool) -> Any:
        """Return a message with the same content that belongs to nobody else.

        Args:
            is_held: Whether somebody else refers to it.
        """
        # One of a derived class becomes what it would be after the middleware.
        if is_held or type(message) is not self._class:
            return self.copy(message)
        return self.move(message)

    def copy(self, message: Any) -> Any:
        """Return a copy that shares nothing that can change."""
        new: Any = object.__new__(self._class)
        for name in self._others:
            setattr(new, name, getattr(message, name))
        for name, copier in self._copiers:
            value = getattr(message, name)
            setattr(new, name, value if copier is None else copier(value))
        return new

    def blank(self) -> Any:
        """Return a message whose fields are to be set, all of them.

        The constructor makes the defaults of all fields, down to the innermost message, for those
        that are set then, too: twice the time.
        """
        new: Any = object.__new__(self._class)
        for name, value in self._other_values:
            setattr(new, name, value)
        return new

    def move(self, message: Any) -> Any:
        """Copy what others refer to inside a message to which nobody else refers; return it."""
        for name, mover in self._movers:
            value = getattr(message, name)
            kept = mover(value)
            if kept is not value:
                setattr(message, name, kept)
        return message


@cache
def ownership_of(message_class: type) -> Ownership:
    """Return how messages of a class are copied and moved; it is compiled once."""
    return Ownership(message_class)


class _Probe:
    """Calls as those on the way of a payload to its publisher, which count its references."""

    def publish(self, payload: Any) -> int:
        message = payload
        return 0 if message is None else getrefcount(payload)

    def publish_by_name(self, _name: str, payload: Any) -> int:
        return self.publish(payload)

    def publish_returned(self) -> int:
        def deliver(payload: Any) -> int:
            return self.publish(payload)

        def behave() -> Any:
            return [None]

        result = behave()
        return deliver(result)


UNHELD_ARGUMENT: Final = _Probe().publish_by_name('', [None])
"""The references to a payload in `Publisher.publish` that only `Node.publish` was given."""
UNHELD_RESULT: Final = _Probe().publish_returned()
"""The references to a payload there that a behaviour has returned."""


def _round(value: Any) -> float:
    rounded: float = _FLOAT32.unpack(_FLOAT32.pack(value))[0]
    return rounded


def _copier_for(field_type: FieldType) -> Callable[[Any], Any] | None:
    """Return what copies the values of a field; `None` if they cannot change."""
    copy_item = _item_copier(field_type)
    if field_type.array is None:
        return copy_item
    if copy_item is None or field_type.kind == 'float32':
        return _copy_values
    return lambda values: [copy_item(each) for each in values]


def _copy_values(values: Any) -> Any:
    # An `array.array` as a slice is several times faster than by its `__copy__`.
    return values[:] if type(values) is array else values.copy()


def _item_copier(field_type: FieldType) -> Callable[[Any], Any] | None:
    if field_type.nested is not None:
        return ownership_of(import_interface(field_type.nested)).copy
    return _round if field_type.kind == 'float32' else None


def _mover_for(field_type: FieldType) -> Callable[[Any], Any] | None:
    """Return what moves the values of a field; `None` if they cannot change."""
    move_item = _item_mover(field_type)
    if field_type.array is None:
        return move_item
    copy = _copier_for(field_type)
    assert copy is not None  # noqa: S101 - arrays can change
    if field_type.kind == 'float32':
        move_item = None  # Its arrays keep rounded numbers.

    def move(values: Any) -> Any:
        if getrefcount(values) > _IN_A_FIELD or _is_of_another(values):
            return copy(values)
        if move_item is not None:
            # `enumerate` would hold each item, too.
            for index in range(len(values)):
                item = values[index]
                kept = move_item(item)
                if kept is not item:
                    values[index] = kept
        return values

    return move


def _is_of_another(values: Any) -> bool:
    """Tell whether somebody may change it without a reference to it.

    That is by a weak reference, or in a NumPy array of another's memory. One that subscriptions
    share is write-protected.
    """
    if type(values) is list:
        return False
    if type(values) is not array and (values.base is not None or not values.flags.writeable):
        return True
    return getweakrefcount(values) > 0


def _item_mover(field_type: FieldType) -> Callable[[Any], Any] | None:
    if field_type.nested is None:
        return _round if field_type.kind == 'float32' else None
    ownership = ownership_of(import_interface(field_type.nested))

    def move(message: Any) -> Any:
        is_held = getrefcount(message) > _IN_A_FIELD
        return ownership.take(message, is_held=is_held)

    return move
