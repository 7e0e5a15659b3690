"""Fields of messages as expressions see them."""

from __future__ import annotations

from typing import Any

_PLAIN = (str, bool, int, float, type(None))


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
    """Return a value of a field as expressions see it: messages as views, arrays as lists.

    A field of the type `byte` is a number, as files write it; `bytes` have no literal there.
    """
    if isinstance(value, _PLAIN):
        return value
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if is_message(value):
        return MessageView(value)
    if hasattr(value, 'tolist'):
        # An array of numpy, or of the standard library.
        return value.tolist()
    return [view_fields(item) for item in value]


def without_views(value: Any) -> Any:
    """Return the value of an expression with the messages themselves in place of their views."""
    if isinstance(value, MessageView):
        return message_of(value)
    if isinstance(value, list | tuple):
        return [without_views(item) for item in value]
    return value


def message_of(view: MessageView) -> Any:
    """Return the message of a view; a method of it would look like a field."""
    return view._message  # noqa: SLF001


def explain_error(error: Exception) -> str:
    """Return why an expression over a message has no value."""
    view = f"'{MessageView.__module__}.{MessageView.__name__} object'"
    return str(error).replace(view, 'the message') or type(error).__name__


def is_message(value: Any) -> bool:
    """Return whether a value is a message of a generated class."""
    return hasattr(value, 'get_fields_and_field_types')
