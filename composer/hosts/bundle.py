"""A system as its hosts are brought it."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from composer.errors import UsageError
from composer.hosts.host_parts import Part, PartSources, build_part
from composer.hosts.project_files import build_behaviours, collect_files
from composer.hosts.requirements import (
    PlatformSpec,
    composer_requirements,
    pin,
    project_requirements,
    provide_wheels,
)
from composer.hosts.wheels import build_composer_wheel
from composer.network.servers import used_hosts
from composer.network.variables import ros_variables
from composer.planning.differences import keep_start
from composer.planning.snapshot_data import KEY_OF_ALL, encode_snapshot
from composer.planning.snapshot_taking import take_snapshot
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.language.specs import HostSpec, SystemSpec


class Bundle:
    """What the hosts of a system are brought.

    Args:
        context: The system, without errors.
        given: The file and its layers.
        named: All files that were read.
        words: The arguments of the command line that come after the files.
        read: The variables of the environment that the files read, and whether they are set here.
        addresses: Where hosts look for others, by their names, if not at their addresses: these
            may be names that only ssh here knows.
    """

    def __init__(
        self,
        context: CheckContext,
        given: Sequence[Path],
        named: Iterable[Path],
        words: Sequence[str],
        read: Mapping[str, bool],
        addresses: Mapping[str, str],
    ) -> None:
        self._context, self._read, self._addresses = context, read, addresses
        # Modules come in wheels.
        modules = set(context.modules.list_files())
        others = [path for path in named if path not in modules]
        self._files = collect_files(given, others, context.spec)
        paths = [os.path.relpath(path, self._files.folder) for path in given]
        self._words = [*paths, *words]
        self._composer = build_composer_wheel()

    @property
    def needed_variables(self) -> list[str]:
        """The variables that must be set on each host: those that are set here."""
        return [name for name, is_set in self._read.items() if is_set]

    def build(self, hosts: Iterable[HostSpec], facts: Mapping[str, Any]) -> dict[str, Part]:
        """Return what each host is brought, by its name.

        Raises:
            ComposerError: Something that a host needs is not there.
        """
        return {host.name: self._build(host, facts[host.name]) for host in hosts}

    def _build(self, host: HostSpec, facts: Mapping[str, Any]) -> Part:
        spec = self._with_addresses(self._context.spec.on_host(host.name))
        # A copy asks for the part; what was read stays read.
        snapshot = take_snapshot(replace(self._context, spec=spec))
        python = facts['python']
        target = PlatformSpec((python[0], python[1]), facts['machine'], facts['libc'])
        required = [
            *composer_requirements(
                has_ros=bool(facts['ros']), builds_interfaces=bool(spec.interfaces)
            ),
            *project_requirements(self._files.marks),
        ]
        sources = PartSources(
            spec=spec,
            host=host,
            files=self._files,
            words=self._words,
            wheels=build_behaviours(self._context, snapshot, self._files),
            required=provide_wheels(pin(required, target), target),
            composer=self._composer,
            variables=ros_variables(spec),
            start=encode_snapshot(keep_start(snapshot), KEY_OF_ALL),
            hosts=choose_hosts(self._context.spec),
            read=self._read,
        )
        return build_part(sources, facts)

    def _with_addresses(self, spec: SystemSpec) -> SystemSpec:
        hosts = {
            name: replace(host, address=self._addresses.get(name, host.address))
            for name, host in spec.hosts.items()
        }
        return replace(spec, hosts=hosts)


def choose_hosts(spec: SystemSpec, wanted: Sequence[str] = ()) -> list[HostSpec]:
    """Return the hosts that run a part of a system.

    Args:
        wanted: Those that were asked for; empty for all.

    Raises:
        UsageError: The system declares no hosts, or not one of those that were asked for.
    """
    if not spec.hosts:
        message = f"'{spec.name}' declares no hosts"
        raise UsageError(message, help="give the layer that has 'hosts:'")
    for name in wanted:
        if name not in spec.hosts:
            advice = suggest(name, spec.hosts, 'there are')
            message = f"'{spec.name}' has no host '{name}'"
            raise UsageError(message, help=advice)
    used = used_hosts(spec)
    return [
        host
        for name, host in spec.hosts.items()
        if name in used and (not wanted or name in wanted)
    ]
