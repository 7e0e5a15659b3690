"""The types around a behaviour: of what it is given, and of what it gives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.entity_kinds import PUBLISHED
from composer.language.specs import SubscriptionSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.bindings import Binding
    from composer.language.specs import EndSpec, NodeSpec


@record
class Wire:
    """The types of what a behaviour gets and of what it gives; `None` for none, or unknown.

    Attributes:
        given: The type of its second argument.
        yielded: The type that each yielded payload becomes.
        returned: The type that a returned payload becomes.
        aborted: The type of the result with which an action aborts a goal.
        is_unpublished: Whether nothing publishes what it gives, although `publish:` could.
        needs_payload: Whether a response has to be returned.
        is_read_only: Whether others have what it is given, too.
    """

    given: str | None = None
    yielded: str | None = None
    returned: str | None = None
    aborted: str | None = None
    needs_payload: bool = False
    is_unpublished: bool = False
    is_read_only: bool = False


def wire_of(node: NodeSpec, binding: Binding, has_real_type: Callable[[EndSpec], bool]) -> Wire:
    """Return the types around a behaviour of a node.

    Args:
        has_real_type: Whether the type of an entity is the one that is meant.
    """
    kind, key = binding.kind, binding.key
    if kind is None or binding.entity is None:
        return Wire()
    own = type_in(node, kind.section, binding.entity.name, has_real_type) if kind.channel else None
    published = getattr(binding.entity, 'publish', None) if kind.publishes else None
    sent = type_in(node, 'publishers', published, has_real_type) if published else None

    def type_of(part: str | None) -> str | None:
        if part == PUBLISHED:
            return sent
        if part is None or own is None:
            return None
        return f'{own}_{part}' if part else own

    return Wire(
        given=None if getattr(binding.entity, 'raw', False) else type_of(key.given),
        yielded=type_of(key.yielded),
        returned=type_of(key.returned),
        aborted=type_of(key.returned) if kind.channel == 'action' else None,
        needs_payload=key.returned not in (None, PUBLISHED),
        is_unpublished=key.returned == PUBLISHED and published is None,
        is_read_only=isinstance(binding.entity, SubscriptionSpec) and binding.entity.read_only,
    )


def type_in(
    node: NodeSpec, section: str, name: str, has_real_type: Callable[[EndSpec], bool]
) -> str | None:
    """Return the type of an entity; `None` if there is none, or none that is known."""
    entity: Any = getattr(node, section).get(name)
    return entity.type if entity is not None and has_real_type(entity) else None
