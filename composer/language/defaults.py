"""The defaults of a file: written into its nodes and processes, so that they hold nowhere else."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

from composer.language.namespaces import join_namespaces, note_namespace
from composer.language.parsing.process_parser import takes_ros_arguments, with_defaults, with_waits

if TYPE_CHECKING:
    from composer.language.instances import Instance
    from composer.yaml_text.positions import DataPath

# What defaults hold that is not simply a key of each node.
_SPECIAL_DEFAULTS = ('namespace', 'qos')
_WITH_QOS = ('publishers', 'subscriptions')


def push_defaults(instance: Instance) -> None:
    """Write the defaults of a file into its nodes, so that they hold nowhere else."""
    defaults = instance.data.pop('defaults', {})
    if not defaults:
        return
    pushing = _Pushing(instance, defaults)
    for section, write in (('nodes', pushing.in_node), ('processes', pushing.in_process)):
        entries = instance.data.get(section, {})
        for name in entries:
            entries[name] = write(name, entries[name])


class _Pushing:
    """Writes the defaults of one file into its nodes and processes."""

    def __init__(self, instance: Instance, defaults: dict[str, Any]) -> None:
        self._instance = instance
        self._defaults = defaults
        self._branches = instance.positions.branches(('defaults',))
        self._notes = [(at, note) for at, note in instance.notes.items() if at[0] == 'defaults']

    def in_node(self, name: str, node: dict[str, Any]) -> dict[str, Any]:
        at = ('nodes', name)
        plain = {k: v for k, v in self._defaults.items() if k not in _SPECIAL_DEFAULTS}
        for key in plain.keys() - node.keys():
            self._graft((*at, key), key)
        full = plain | node
        if not name.startswith('/'):
            full |= self._namespace(at, node)
        if 'qos' in self._defaults:
            for section in _WITH_QOS:
                if section in full:
                    full[section] = self._with_qos((*at, section), full[section])
        return full

    def in_process(self, name: str, process: dict[str, Any]) -> dict[str, Any]:
        if not takes_ros_arguments(process):
            return with_waits(process, {}, self._defaults.get('namespace', ''))
        at = ('processes', name)
        full = with_defaults(process, self._defaults)
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
            note_namespace(self._instance, (*at, 'namespace'), ('defaults', 'namespace'), inner)
        return {'namespace': namespace} if namespace else {}

    def _with_qos(self, at: DataPath, entries: dict[str, Any]) -> dict[str, Any]:
        changed = {}
        positions = self._instance.positions
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
        self._instance.positions.graft(path, self._branches[key])
        for at, note in self._notes:
            if at[1] == key:
                self._instance.notes[path + at[2:]] = note
