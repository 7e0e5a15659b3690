"""What an included file declares, added to the file that includes it under names of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.language.includes.profile_names import (
    ProfileRenaming,
    free_name,
    rename_profiles,
)
from composer.language.namespaces import (
    full_node_name,
    join_namespaces,
    note_namespace,
    split_node_name,
)
from composer.language.parsing.process_parser import takes_ros_arguments, with_waits
from composer.records import record

if TYPE_CHECKING:
    from composer.language.includes.include_entry import IncludeEntry
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import Branch, DataPath


@record
class Inclusion:
    """A file that was read for an include.

    Attributes:
        entry: The include.
        namespace: The namespace of all that comes out of the file.
    """

    part: LoadedSystem
    entry: IncludeEntry
    namespace: str


class IncludeMerger:
    """Adds what included files declare to the file that includes them."""

    def __init__(self, system: LoadedSystem) -> None:
        self._whole = system
        self._full_names = {
            full_node_name(*split_node_name(name, node))
            for name, node in system.entries.get('nodes', {}).items()
            if ('nodes', name) not in system.left_out
        }

    def add(self, inclusion: Inclusion) -> None:
        """Add what an included file declares."""
        part = inclusion.part
        renaming = self._add_profiles(inclusion)
        keys = self._process_keys(inclusion)
        for name, node in part.entries.get('nodes', {}).items():
            inner, simple = part.inner_names.get(name) or split_node_name(name, node)
            full = join_namespaces(inclusion.namespace, inner)
            is_left_out = ('nodes', name) in part.left_out
            key = self._node_key(simple, full, is_left_out=is_left_out)
            if key is not None:
                entry = with_waits(renaming.in_node(node), keys)
                if key.startswith('/'):
                    # Includes around this one must still find a relative namespace as such.
                    self._whole.inner_names[key] = full, simple
                self._add_entry(inclusion, ('nodes', name), key, entry)
            elif not is_left_out:
                self._report_duplicate(inclusion, name, full_node_name(full, simple))
        for name, process in part.entries.get('processes', {}).items():
            entry = with_waits(renaming.in_process(process), keys)
            if not takes_ros_arguments(process):
                entry = with_waits(entry, {}, inclusion.namespace)
            self._add_entry(inclusion, ('processes', name), keys[name], entry)
        for section in ('interfaces', 'workers', 'hosts'):
            self._add_declared(section, part)
        self._whole.sampled += part.sampled
        self._whole.sampled_unused += part.sampled_unused
        self._whole.included |= {part.positions.source: None} | part.included
        self._whole.named |= part.named

    def _node_key(self, simple: str, namespace: str, *, is_left_out: bool) -> str | None:
        """Return a key that is free: the name, or the full name; `None` if that is taken too."""
        nodes = self._whole.entries.setdefault('nodes', {})
        full = full_node_name(namespace, simple)
        key = full if simple in nodes else simple
        if is_left_out:
            return None if key in nodes else key
        if full in self._full_names:
            return None
        self._full_names.add(full)
        return key

    def _process_keys(self, inclusion: Inclusion) -> dict[str, str]:
        """Return what the processes of a file are called in the whole system."""
        processes, left_out = self._whole.entries.get('processes', {}), self._whole.left_out
        # What is left out gives way.
        own = [name for name in processes if ('processes', name) not in left_out]
        names = inclusion.part.entries.get('processes', {})
        taken = {*own, *names}
        keys = {}
        for name in names:
            keys[name] = (
                free_name(f'{inclusion.entry.label}_{name}', taken) if name in own else name
            )
            taken.add(keys[name])
        return keys

    def _report_duplicate(self, inclusion: Inclusion, name: str, full: str) -> None:
        # What it has is missing now, which is the same mistake.
        self._whole.dropped.add(('include', inclusion.entry.label))
        inner = inclusion.part.chains.get(('nodes', name), ())
        self._whole.diagnostics.append(
            diagnostic_at(
                inclusion.part.positions.key(('nodes', name)),
                'duplicate-node',
                f"a node '{full}' already exists",
                help="give the include a 'namespace'",
                related=[*inner, inclusion.entry.here],
            )
        )

    def _add_entry(
        self, inclusion: Inclusion, old: DataPath, key: str, entry: dict[str, Any]
    ) -> None:
        whole, part = self._whole, inclusion.part
        section, name = str(old[0]), old[1]
        new = (section, key)
        whole.positions.graft(new, part.branches(section)[name])
        for path, note in part.notes_by_entry().get(old, ()):
            whole.notes[new + path] = note
        if section == 'nodes' or takes_ros_arguments(entry):
            entry = self._with_outer(inclusion, new, entry)
        entry = self._placed(inclusion, old, new, entry)
        whole.entries.setdefault(section, {})[key] = entry
        whole.dropped |= {new + path[2:] for path in part.dropped if path[:2] == old}
        whole.chains[new] = (*part.chains.get(old, ()), inclusion.entry.here)
        self._leave_out(new, is_left_out=old in part.left_out)
        whole.left_out |= {
            (*new, *path[2:]) for path in part.left_out if len(path) > len(old) and path[:2] == old
        }

    def _leave_out(self, path: DataPath, *, is_left_out: bool) -> None:
        if is_left_out:
            self._whole.left_out.add(path)
        else:
            self._whole.left_out.discard(path)

    def _with_outer(
        self, inclusion: Inclusion, path: DataPath, entry: dict[str, Any]
    ) -> dict[str, Any]:
        """Return an entry with what the include says of all that comes out of the file."""
        plain = dict(entry)
        inner = plain.pop('namespace', '')
        namespace = join_namespaces(inclusion.namespace, inner)
        if namespace != inner:
            note_namespace(
                self._whole, (*path, 'namespace'), (*inclusion.entry.at, 'namespace'), inner
            )
        is_in_key = path[0] == 'nodes' and str(path[-1]).startswith('/')
        if namespace and not is_in_key:
            plain = {'namespace': namespace} | plain
        if 'components' in plain:
            plain['components'] = {
                key: self._with_outer(inclusion, (*path, 'components', key), each)
                for key, each in plain['components'].items()
            }
        if inclusion.entry.remap:
            # The first rule that fits wins: those from outside do, as in ROS launch.
            plain['remap'] = {
                **inclusion.entry.remap,
                **_beside(inclusion.entry.remap, plain.get('remap')),
            }
            for rule in inclusion.entry.remap:
                self._copy_place((*inclusion.entry.at, 'remap', rule), (*path, 'remap', rule))
        return plain

    def _placed(
        self, inclusion: Inclusion, old: DataPath, new: DataPath, entry: dict[str, Any]
    ) -> dict[str, Any]:
        """Return an entry that runs where the include says, if it does not say so itself."""
        outer = inclusion.entry
        keys = ('worker', 'host') if new[0] == 'nodes' else ('host',)
        given = {key: outer.data[key] for key in keys if key in outer.data and key not in entry}
        for key in given:
            self._copy_place((*outer.at, key), (*new, key))
        if 'host' in given or (*old, 'host') in inclusion.part.inherited:
            self._whole.inherited.add((*new, 'host'))
        return {**entry, **given}

    def _copy_place(self, old: DataPath, new: DataPath) -> None:
        positions, notes = self._whole.positions, self._whole.notes
        positions.keys[new] = positions.key(old)
        positions.values[new] = positions.value(old)
        notes.pop(new, None)
        if old in notes:
            notes[new] = notes[old]

    def _add_profiles(self, inclusion: Inclusion) -> ProfileRenaming:
        """Add the QoS profiles of a file; return the new names of those that had to be renamed."""
        part = inclusion.part
        profiles = part.entries.get('qos', {})
        renaming = rename_profiles(
            self._whole.entries.get('qos', {}), profiles, inclusion.entry.label
        )
        for name, profile in profiles.items():
            key = str(renaming.in_qos(name))
            own = self._whole.entries.setdefault('qos', {})
            is_left_out = ('qos', name) in part.left_out
            if not (key in own and is_left_out):
                self._leave_out(('qos', key), is_left_out=is_left_out)
            if key in own:
                continue
            own[key] = renaming.in_qos(profile)
            self._whole.positions.graft(('qos', key), part.branches('qos')[name])
            for path, note in part.notes_by_entry().get(('qos', name), ()):
                self._whole.notes['qos', key, *path] = note
        self._whole.dropped |= {path for path in part.dropped if path[:1] == ('qos',)}
        return renaming

    def _add_declared(self, section: str, part: LoadedSystem) -> None:
        """Add what a file declares in a section whose names hold everywhere.

        What the file around it says under such a name stays; the rest is added key by key.
        """
        for name in part.entries.get(section, {}):
            declared = self._whole.entries.setdefault(section, {})
            path = (section, name)
            is_left_out = path in part.left_out
            if not (name in declared and is_left_out):
                self._leave_out(path, is_left_out=is_left_out)
            entry, branch = part.entries[section][name], part.branches(section)[name]
            if name not in declared:
                declared[name] = entry
                self._whole.positions.graft(path, branch)
            elif section == 'interfaces':
                self._add_interfaces(name, entry, branch)
            elif isinstance(entry, dict) and not is_left_out:
                added = entry.keys() - declared[name].keys()
                declared[name] = {**entry, **declared[name]}
                self._whole.positions.graft(path, branch.only(added))

    def _add_interfaces(self, package: str, entry: str | dict[str, Any], branch: Branch) -> None:
        """Add the interfaces that a file lists of a package; without a list, it needs all."""
        declared = self._whole.entries['interfaces'][package]
        if isinstance(declared, str) or 'only' not in declared:
            return
        if isinstance(entry, str) or 'only' not in entry:
            self._whole.entries['interfaces'][package] = declared['folder']
            return
        spans = dict(branch.values)
        listed = [*declared['only']]
        self._whole.entries['interfaces'][package] = {**declared, 'only': listed}
        for index, interface in enumerate(entry['only']):
            if interface not in listed:
                at = ('interfaces', package, 'only', len(listed))
                self._whole.positions.values[at] = spans['only', index]
                listed.append(interface)


def _beside(outer: dict[str, str], inner: dict[str, str] | None) -> dict[str, str]:
    return {old: new for old, new in (inner or {}).items() if old not in outer}
