"""Messages as plain data, for people to read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

_MOST_ITEMS = 128


def plain_message(value: Any) -> Any:
    """Return a message as YAML has it; of long arrays only the beginning."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {
            name: plain_message(getattr(value, name))
            for name in value.get_fields_and_field_types()
        }
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, str | bool | int | float):
        return value
    items: Sequence[Any] = value[:_MOST_ITEMS]
    items = items.tolist() if hasattr(items, 'tolist') else items
    more = [f'… {len(value) - len(items)} more'] if len(value) > len(items) else []
    return [*map(plain_message, items), *more]
