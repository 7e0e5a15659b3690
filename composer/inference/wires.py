"""The types around a behaviour: of what it is given, and of what it gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.entity_kinds import PUBLISHED
from composer.language.specs import SubscriptionSpec
from composer.records import record

if TYPE_CHECKING:
    from composer.inference.node_facts import NodeFacts
    from composer.language.bindings import Binding


@record
class Wire:
    """The types of what a behaviour gets and of what it gives; `None` for none, or unknown.

    Attributes:
        given: The type of its second argument.
        yielded: The type that each yielded payload becomes.
        returned: The type that a returned payload becomes.
        ended: The type that a payload becomes which a generator returns.
        is_unpublished: Whether nothing publishes what it gives, although `publish:` could.
        needs_payload: Whether a response has to be returned.
        is_read_only: Whether others have what it is given, too.
    """

    given: str | None = None
    yielded: str | None = None
    returned: str | None = None
    ended: str | None = None
    needs_payload: bool = False
    is_unpublished: bool = False
    is_read_only: bool = False


def wire_of(binding: Binding, facts: NodeFacts) -> Wire:
    """Return the types around a behaviour of a node."""
    kind, key = binding.kind, binding.key
    if kind is None or binding.entity is None:
        return Wire()
    own = facts.type_of(kind.section, binding.entity.name) if kind.channel else None
    published = getattr(binding.entity, 'publish', None) if kind.publishes else None
    sent = facts.type_of('publishers', published) if published else None

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
        ended=type_of(key.returned),
        needs_payload=key.returned not in (None, PUBLISHED),
        is_unpublished=key.returned == PUBLISHED and published is None,
        is_read_only=isinstance(binding.entity, SubscriptionSpec) and binding.entity.read_only,
    )
