"""The defaults of a file, written into its nodes and processes: they hold nowhere else."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import CHANNEL_KINDS
from composer.language.includes.profile_names import drop_unknown_profiles
from composer.language.namespaces import join_namespaces, note_namespace
from composer.language.parsing.process_parser import takes_ros_arguments, with_defaults, with_waits

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

# What defaults hold that is not simply a key of each node.
_SPECIAL_DEFAULTS = ('namespace', 'qos')
# The QoS of defaults is for topics; rmw has a profile of its own for services.
_WITH_QOS = [kind.section for kind in CHANNEL_KINDS if kind.has_qos and kind.channel == 'topic']


def apply_defaults(system: LoadedSystem) -> None:
    """Write the defaults of a file into its nodes and processes, and drop unknown profiles."""
    data = system.entries
    defaults = data.pop('defaults', {})
    if defaults:
        writer = _DefaultsWriter(system, defaults)
        for section, write in (
            ('nodes', writer.in_node),
            ('processes', writer.in_process),
            ('include', writer.in_include),
        ):
            if section in data:
                entries = data[section].items()
                data[section] = {name: write(name, entry) for name, entry in entries}
    drop_unknown_profiles(system)


class _DefaultsWriter:
    """Writes the defaults of one file into its nodes and processes."""

    def __init__(self, system: LoadedSystem, defaults: dict[str, Any]) -> None:
        self._system = system
        self._defaults = defaults
        self._branches = system.positions.branches(('defaults',))
        self._notes = [(at, note) for at, note in system.notes.items() if at[0] == 'defaults']

    def in_node(self, name: str, node: dict[str, Any]) -> dict[str, Any]:
        at = ('nodes', name)
        plain = {k: v for k, v in self._defaults.items() if k not in _SPECIAL_DEFAULTS}
        for key in plain.keys() - node.keys():
            self._graft((*at, key), key)
        full = plain | node
        if 'host' in plain and 'host' not in node:
            self._system.inherited.add((*at, 'host'))
        if not name.startswith('/'):
            full |= self._namespace(at, node)
        if 'qos' in self._defaults:
            for section in _WITH_QOS:
                if section in full:
                    full[section] = self._with_qos((*at, section), full[section])
        return full

    def in_process(self, name: str, process: dict[str, Any]) -> dict[str, Any]:
        at = ('processes', name)
        process = self._placed(at, process, 'host')
        if not takes_ros_arguments(process):
            return with_waits(process, {}, self._defaults.get('namespace', ''))
        return self._in_program(at, process)

    def in_include(self, name: str, include: dict[str, Any]) -> dict[str, Any]:
        return self._placed(('include', name), include, 'worker', 'host')

    def _placed(self, at: DataPath, entry: dict[str, Any], *keys: str) -> dict[str, Any]:
        """Return an entry that says where it runs, if it or the defaults do."""
        given = [key for key in keys if key in self._defaults and key not in entry]
        for key in given:
            self._graft((*at, key), key)
        return entry | {key: self._defaults[key] for key in given}

    def _in_program(self, at: DataPath, process: dict[str, Any]) -> dict[str, Any]:
        full = with_defaults(process, self._defaults)
        if 'components' in full:
            full['components'] = {
                key: self._in_program((*at, 'components', key), component)
                for key, component in full['components'].items()
            }
        if 'log_level' in full and 'log_level' not in process:
            self._graft((*at, 'log_level'), 'log_level')
        if (
            'use_sim_time'
            in full.get('parameters', {}).keys() - process.get('parameters', {}).keys()
        ):
            self._graft((*at, 'parameters', 'use_sim_time'), 'use_sim_time')
        return full | self._namespace(at, process)

    def _namespace(self, at: DataPath, entry: dict[str, Any]) -> dict[str, str]:
        outer, inner = self._defaults.get('namespace', ''), entry.get('namespace', '')
        namespace = join_namespaces(outer, inner)
        if namespace != inner:
            note_namespace(self._system, (*at, 'namespace'), ('defaults', 'namespace'), inner)
        return {'namespace': namespace} if namespace else {}

    def _with_qos(self, at: DataPath, entries: dict[str, Any]) -> dict[str, Any]:
        changed = {}
        positions = self._system.positions
        for name, entry in entries.items():
            path = (*at, name)
            mapping = {'type': entry} if isinstance(entry, str) else entry
            if isinstance(entry, str):
                positions.values[*path, 'type'] = positions.value(path)
            if 'qos' not in mapping:
                mapping = mapping | {'qos': deepcopy(self._defaults['qos'])}
                self._graft((*path, 'qos'), 'qos')
            changed[name] = mapping
        return changed

    def _graft(self, path: DataPath, key: str) -> None:
        self._system.positions.graft(path, self._branches[key])
        for at, note in self._notes:
            if at[1] == key:
                self._system.notes[path + at[2:]] = note
