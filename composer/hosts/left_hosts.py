"""Hosts that may have a part of a system, and are to have none any more."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import UsageError
from composer.hosts.host_parts import read_hosts
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from composer.language.specs import HostSpec


class Candidates:
    """The hosts of the inventory, and those that releases name, without anything to run.

    Args:
        facts: What the hosts say of themselves that have a part, by their names.
        inventory: The hosts that the files declare.
        wanted: The names of those to change; empty for all.

    Attributes:
        musts: The names of those that may not stay unknown: they had a part, or are wanted.
    """

    def __init__(
        self,
        facts: Mapping[str, Mapping[str, Any]],
        inventory: Mapping[str, HostSpec],
        wanted: Collection[str],
    ) -> None:
        known: dict[str, HostSpec] = {}
        for each in facts.values():
            known |= read_hosts(each['manifest'])
        self.musts = {*known, *wanted}
        self._hosts = {
            name: host
            for name, host in {**known, **inventory}.items()
            if name not in facts and (not wanted or name in wanted)
        }

    def list_asked(self, leave: Collection[str]) -> list[HostSpec]:
        """Return those that are to be asked.

        Args:
            leave: The names of those to leave as they are.

        Raises:
            UsageError: One of these has something to run, or is not known.
        """
        for name in leave:
            if name not in self._hosts:
                message = f"'{name}' is no host without anything to run"
                advice = suggest(name, self._hosts, 'there are', 'there is none')
                raise UsageError(message, help=advice)
        return [host for name, host in self._hosts.items() if name not in leave]


def has_part(facts: Mapping[str, Any], system: str, name: str) -> bool:
    """Return whether a host has the part of this name: it may have that of another one."""
    manifest = facts['manifest']
    return manifest is not None and bool(manifest['part'] == f'{system}@{name}')
