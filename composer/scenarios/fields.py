"""Fields of messages as expressions see them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

_PLAIN = (str, bytes, bool, int, float, type(None))


class MessageView:
    """A message whose arrays, of whatever class, are lists."""

    __slots__ = ('_message',)

    def __init__(self, message: Any) -> None:
        self._message = message

    def __getattr__(self, name: str) -> Any:
        return view_fields(getattr(self._message, name))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MessageView) and bool(self._message == other._message)

    def __hash__(self) -> int:
        return hash(id(self._message))


def view_fields(value: Any) -> Any:
    """Return a value of a field as expressions see it: messages as views, arrays as lists."""
    if isinstance(value, _PLAIN):
        return value
    if is_message(value):
        return MessageView(value)
    if hasattr(value, 'tolist'):
        # An array of numpy, or of the standard library.
        return value.tolist()
    return [view_fields(item) for item in value]


def is_message(value: Any) -> bool:
    """Return whether a value is a message of a generated class."""
    return hasattr(value, 'get_fields_and_field_types')


def field_names(message: Any) -> Iterator[str]:
    """Yield the names of the fields of a message, in the order of its definition."""
    return iter(message.get_fields_and_field_types())
