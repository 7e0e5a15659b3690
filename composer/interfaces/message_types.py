"""What the types of messages have: fields, parts, and what fits into them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.descriptions import (
    ActionDescription,
    MessageDescription,
    ServiceDescription,
)

if TYPE_CHECKING:
    from composer.interfaces.catalogue import InterfaceCatalogue

PARTS = ('Request', 'Response', 'Goal', 'Result', 'Feedback')


class MessageTypes:
    """The types of messages that behaviours meet."""

    def __init__(self, catalogue: InterfaceCatalogue) -> None:
        self.catalogue = catalogue
        self._found: dict[str, MessageDescription | None] = {}

    def describe(self, name: str) -> MessageDescription | None:
        """Describe a message, or a part of a service or action: `std_srvs/srv/SetBool_Request`."""
        if name not in self._found:
            self._found[name] = self._describe(name)
        return self._found[name]

    def _describe(self, name: str) -> MessageDescription | None:
        whole, part = split_part(name)
        description = self.catalogue.describe(whole)
        if isinstance(description, ServiceDescription | ActionDescription):
            return getattr(description, part.lower(), None) if part else None
        return description if isinstance(description, MessageDescription) else None

    def may_have_constant(self, type_name: str, name: str) -> bool:
        """Return whether a message may have a constant of this name."""
        if name.endswith('__DEFAULT'):
            return True
        if self.describe(type_name) is None or name in (known := self.constants(type_name)):
            return True
        # A description without any may come without those that there are.
        return not (known or self.catalogue.knows_constants(split_part(type_name)[0]))

    def constants(self, type_name: str) -> list[str]:
        """Return the names of the constants that are known."""
        description = self.describe(type_name)
        return sorted(each.name for each in description.constants) if description else []

    def are_alike(self, one: str, other: str) -> bool:
        """Return whether two types are the same for a behaviour.

        Types of one name in two packages are the same if they have the same fields, or if their
        fields are unknown: the examples of ROS come in several packages.
        """
        if one == other:
            return True
        if one.rpartition('/')[2] != other.rpartition('/')[2]:
            return False
        first, second = self.describe(one), self.describe(other)
        return first is None or second is None or _fields(first) == _fields(second)


def _fields(description: MessageDescription) -> list[tuple[str, str]]:
    return [(field.name, str(field.type)) for field in description.fields]


def split_part(name: str) -> tuple[str, str]:
    """Return an interface and its part, which is empty for a message."""
    whole, _, part = name.rpartition('_')
    return (whole, part) if part in PARTS else (name, '')


def in_python(name: str) -> str:
    """Return `std_srvs/srv/SetBool.Request` for `std_srvs/srv/SetBool_Request`."""
    whole, part = split_part(name)
    return f'{whole}.{part}' if part else whole
