"""QoS profiles of included files: the names of each file are its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.entity_kinds import ENTITY_KINDS
from composer.language.parsing.declared_ends import entries_with_ends
from composer.language.qos import BUILTIN_PROFILES
from composer.spelling import suggest
from composer.yaml_text.document import copy_data

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

_WITH_QOS = [kind.section for kind in ENTITY_KINDS if kind.has_qos]


class ProfileRenaming:
    """Writes new names of QoS profiles where the old ones are used."""

    def __init__(self, names: dict[str, str]) -> None:
        self._names = names

    def in_process(self, process: dict[str, Any]) -> dict[str, Any]:
        """Return a process whose ends, and those of its nodes, use the new names."""
        changed = self.in_node(process)
        for key in ('nodes', 'components'):
            nodes = changed.get(key)
            if self._names and isinstance(nodes, dict):
                renamed = {name: node and self.in_node(node) for name, node in nodes.items()}
                changed = changed | {key: renamed}
        return changed

    def in_node(self, node: dict[str, Any]) -> dict[str, Any]:
        """Return a node whose entities use the new names."""
        if not self._names:
            return node
        changed = dict(node)
        for section in _WITH_QOS:
            if section in node:
                changed[section] = {
                    name: entry | {'qos': self.in_qos(entry['qos'])}
                    if isinstance(entry, dict) and 'qos' in entry
                    else entry
                    for name, entry in node[section].items()
                }
        return changed

    def in_qos(self, qos: Any) -> Any:
        """Return a QoS, or a profile, that uses the new names."""
        if isinstance(qos, str):
            return self._names.get(qos, qos)
        if isinstance(qos, dict) and 'profile' in qos:
            return qos | {'profile': self._names.get(qos['profile'], qos['profile'])}
        return qos


def rename_profiles(own: dict[str, Any], profiles: dict[str, Any], label: str) -> ProfileRenaming:
    """Return new names for the profiles that would mean something else under their own.

    Args:
        own: The profiles that are there already.
        profiles: Those of the included file.
        label: The name of the include.
    """
    renamed = {name for name in profiles if name in own and own[name] != profiles[name]}
    shared = profiles.keys() & own.keys() - renamed
    while following := {name for name in shared if _base(profiles[name]) in renamed}:
        renamed |= following
        shared -= following
    taken = {*own, *profiles}
    names: dict[str, str] = {}
    for name in profiles:
        if name in renamed:
            names[name] = free_name(f'{label}_{name}', taken)
            taken.add(names[name])
    return ProfileRenaming(names)


def drop_unknown_profiles(system: LoadedSystem) -> None:
    """Report the profiles that a file uses and does not declare, and leave out these uses.

    A profile of the same name in another file does not count.
    """
    known = {**system.entries.get('qos', {}), **BUILTIN_PROFILES}
    if all(holder[key] in known for holder, key, _ in _uses(system.entries)):
        return
    system.data = copy_data(system.data)
    reported = set()
    for holder, key, path in list(_uses(system.entries)):
        name = holder[key]
        if name in known:
            continue
        span = system.positions.value(path)
        if span not in reported:
            reported.add(span)
            finding = diagnostic_at(
                span,
                'unknown-qos-profile',
                f"there is no QoS profile '{name}'",
                help=suggest(name, known, 'the profiles are'),
            )
            system.diagnostics.append(finding)
        del holder[key]
        system.dropped.add(path)


def free_name(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not taken, as near as can be to the one that is wanted."""
    taken = set(taken)
    while name in taken:
        name = f'{name}_'
    return name


def _uses(data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str, DataPath]]:
    """Yield where profiles are named: the mapping, the key in it, and the path."""
    for name, profile in data.get('qos', {}).items():
        if isinstance(profile, dict) and 'profile' in profile:
            yield profile, 'profile', ('qos', name, 'profile')
    for at, node in _with_entities(data):
        for section in _WITH_QOS:
            for name, entry in node.get(section, {}).items():
                qos = entry.get('qos') if isinstance(entry, dict) else None
                path = (*at, section, name, 'qos')
                if isinstance(qos, str):
                    yield entry, 'qos', path
                elif isinstance(qos, dict) and 'profile' in qos:
                    yield qos, 'profile', (*path, 'profile')


def _with_entities(data: dict[str, Any]) -> Iterator[tuple[DataPath, dict[str, Any]]]:
    """Yield the nodes, those of processes too, with their paths."""
    for name, node in data.get('nodes', {}).items():
        yield ('nodes', name), node
    for name, process in data.get('processes', {}).items():
        for at, entry in entries_with_ends(process):
            yield ('processes', name, *at), entry


def _base(profile: Any) -> str | None:
    return profile.get('profile') if isinstance(profile, dict) else None
