"""What an included file declares becomes part of the including one, under names of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Related, diagnostic_at
from composer.language.processes import takes_ros_arguments, with_defaults, with_waits

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.language.instances import Instance
    from composer.language.positions import Branch, DataPath, Key

# What defaults hold that is not simply a key of each node.
_SPECIAL_DEFAULTS = ('namespace', 'qos')
_WITH_QOS = ('publishers', 'subscriptions')


def push_defaults(instance: Instance) -> None:
    """Write the defaults of a file into its nodes, so that they hold nowhere else."""
    defaults = instance.data.pop('defaults', {})
    if not defaults:
        return
    shared = instance.positions.branches(('defaults',))
    outer = defaults.get('namespace', '')
    nodes = instance.data.get('nodes', {})
    for name in nodes:
        nodes[name] = _with_defaults(instance, name, nodes[name], defaults, shared)
    processes = instance.data.get('processes', {})
    for name, process in processes.items():
        processes[name] = _in_namespace(outer, with_defaults(process, defaults))


def _in_namespace(outer: str, process: dict[str, Any]) -> dict[str, Any]:
    """Return a process that lies in a namespace; if it is none of ROS, what it waits for does."""
    if not takes_ros_arguments(process):
        return with_waits(process, {}, outer)
    namespace = _join(outer, process.get('namespace', ''))
    return process | {'namespace': namespace} if namespace else process


def _with_defaults(
    instance: Instance,
    name: str,
    node: dict[str, Any],
    defaults: dict[str, Any],
    shared: dict[Key, Branch],
) -> dict[str, Any]:
    at = ('nodes', name)
    plain = {key: value for key, value in defaults.items() if key not in _SPECIAL_DEFAULTS}
    for key in plain.keys() - node.keys():
        instance.positions.graft((*at, key), shared[key])
    full = plain | node
    namespace = _join(defaults.get('namespace', ''), node.get('namespace', ''))
    if namespace and not name.startswith('/'):
        if 'namespace' not in node:
            instance.positions.graft((*at, 'namespace'), shared['namespace'])
        full['namespace'] = namespace
    if 'qos' in defaults:
        for section in _WITH_QOS:
            if section in full:
                entries = _with_qos(instance, (*at, section), full[section], defaults, shared)
                full[section] = entries
    return full


def _with_qos(
    instance: Instance,
    at: DataPath,
    entries: dict[str, Any],
    defaults: dict[str, Any],
    shared: dict[Key, Branch],
) -> dict[str, Any]:
    changed = {}
    positions = instance.positions
    for name, entry in entries.items():
        path = (*at, name)
        if isinstance(entry, str):
            positions.values[*path, 'type'] = positions.value(path)
            changed[name] = {'type': entry, 'qos': defaults['qos']}
        else:
            changed[name] = {'qos': defaults['qos']} | entry
        if isinstance(entry, str) or 'qos' not in entry:
            positions.graft((*path, 'qos'), shared['qos'])
    return changed


@dataclass(frozen=True, slots=True)
class Inclusion:
    """A file that was read for an include.

    Attributes:
        at: Where the include stands.
        entry: What it says.
    """

    part: Instance
    at: DataPath
    entry: dict[str, Any]

    @property
    def label(self) -> str:
        """The name of the include."""
        return str(self.at[-1])

    @property
    def namespace(self) -> str:
        """The namespace of all that comes out of the file."""
        return str(self.entry.get('namespace', ''))

    @property
    def remap(self) -> dict[str, str]:
        """Rules for all that comes out of the file."""
        rules: dict[str, str] = self.entry.get('remap', {})
        return rules


class Flattening:
    """Adds what included files declare to the instance of the file that includes them."""

    def __init__(self, instance: Instance) -> None:
        self._whole = instance
        nodes = instance.data.get('nodes', {})
        self._full_names = {_full_name(*_split(name, node)) for name, node in nodes.items()}

    def add(self, inclusion: Inclusion) -> None:
        """Add what an included file declares."""
        part = inclusion.part
        push_defaults(part)
        renaming = self._add_profiles(inclusion)
        processes = self._process_names(inclusion)
        for name, node in part.data.get('nodes', {}).items():
            inner, simple = _split(name, node)
            full = _join(inclusion.namespace, inner)
            key = self._node_key(simple, full)
            if key is not None:
                entry = with_waits(renaming.in_node(node), processes)
                self._add_entry(inclusion, ('nodes', name), key, entry, full)
            elif ('nodes', name) not in part.left_out:
                self._report_duplicate(inclusion, name, _full_name(full, simple))
        for name, process in part.data.get('processes', {}).items():
            entry = with_waits(_in_namespace(inclusion.namespace, process), processes)
            namespace = entry.get('namespace', '')
            self._add_entry(inclusion, ('processes', name), processes[name], entry, namespace)
        self._add_interfaces(part)
        self._whole.sampled_spans += part.sampled_spans

    def _process_names(self, inclusion: Inclusion) -> dict[str, str]:
        """Return what the processes of a file are called in the whole."""
        own = self._whole.data.get('processes', {})
        names = inclusion.part.data.get('processes', {})
        return {
            name: _free_name(f'{inclusion.label}_{name}', {*own, *names}) if name in own else name
            for name in names
        }

    def _node_key(self, simple: str, namespace: str) -> str | None:
        """Return a key that is free: the name, or the full name; `None` if that is taken too."""
        nodes = self._whole.data.setdefault('nodes', {})
        full = _full_name(namespace, simple)
        if full in self._full_names:
            return None
        self._full_names.add(full)
        return full if simple in nodes else simple

    def _report_duplicate(self, inclusion: Inclusion, name: str, full: str) -> None:
        place = self._whole.positions.value((*inclusion.at, 'file'))
        self._whole.diagnostics.append(
            diagnostic_at(
                inclusion.part.positions.key(('nodes', name)),
                'duplicate-node',
                f"there is a node '{full}' already",
                help="give the include a 'namespace'",
                related=[Related('included here', place)],
            )
        )

    def _add_entry(
        self, inclusion: Inclusion, old: DataPath, key: str, entry: dict[str, Any], namespace: str
    ) -> None:
        whole, part = self._whole, inclusion.part
        section, name = str(old[0]), old[1]
        new = (section, key)
        whole.positions.graft(new, part.branches(section)[name])
        plain = {each: value for each, value in entry.items() if each != 'namespace'}
        if namespace and not key.startswith('/'):
            plain = {'namespace': namespace} | plain
            self._note_namespace((*new, 'namespace'), (*inclusion.at, 'namespace'))
        if inclusion.remap and (section == 'nodes' or takes_ros_arguments(entry)):
            # The first rule that fits wins: those from outside do, as in ROS launch.
            plain['remap'] = {**inclusion.remap, **_beside(inclusion.remap, plain.get('remap'))}
            for rule in inclusion.remap:
                written = whole.positions.value((*inclusion.at, 'remap', rule))
                whole.positions.values[*new, 'remap', rule] = written
        whole.data.setdefault(section, {})[key] = plain
        whole.dropped |= {new + path[2:] for path in part.dropped if path[:2] == old}
        for path, note in part.notes_by_entry().get(old, ()):
            whole.notes[new + path] = note
        here = Related('included here', whole.positions.value((*inclusion.at, 'file')))
        whole.chains[new] = (*part.chains.get(old, ()), here)
        if old in part.left_out:
            whole.left_out.add(new)

    def _note_namespace(self, path: DataPath, outer: DataPath) -> None:
        positions = self._whole.positions
        if outer not in positions.values:
            return
        if path in positions.values:
            self._whole.notes[path] = f'in that of {positions.value(outer).place}'
        else:
            positions.values[path] = positions.value(outer)

    def _add_profiles(self, inclusion: Inclusion) -> _ProfileRenaming:
        """Add the QoS profiles of a file; return the new names of those that had to be renamed."""
        part, label = inclusion.part, inclusion.label
        own = self._whole.data.get('qos', {})
        profiles = part.data.get('qos', {})
        renaming = _ProfileRenaming(
            {
                name: _free_name(f'{label}_{name}', {*own, *profiles})
                for name, profile in profiles.items()
                if name in own and own[name] != profile
            }
        )
        for name, profile in profiles.items():
            key = str(renaming.in_qos(name))
            self._whole.positions.graft(('qos', key), part.branches('qos')[name])
            self._whole.data.setdefault('qos', {})[key] = renaming.in_qos(profile)
        self._whole.dropped |= {path for path in part.dropped if path[:1] == ('qos',)}
        return renaming

    def _add_interfaces(self, part: Instance) -> None:
        for package in part.data.get('interfaces', {}):
            declared = self._whole.data.setdefault('interfaces', {})
            if package not in declared:
                declared[package] = part.data['interfaces'][package]
                branch = part.branches('interfaces')[package]
                self._whole.positions.graft(('interfaces', package), branch)


class _ProfileRenaming:
    """Writes new names of QoS profiles where the old ones are used."""

    def __init__(self, names: dict[str, str]) -> None:
        self._names = names

    def in_node(self, node: dict[str, Any]) -> dict[str, Any]:
        """Return a node whose entities use the new names."""
        if not self._names:
            return node
        changed = dict(node)
        for section, entries in node.items():
            if isinstance(entries, dict) and section not in ('parameters', 'state', 'remap'):
                changed[section] = {
                    name: entry | {'qos': self.in_qos(entry['qos'])}
                    if isinstance(entry, dict) and 'qos' in entry
                    else entry
                    for name, entry in entries.items()
                }
        return changed

    def in_qos(self, qos: Any) -> Any:
        """Return a QoS, or a profile, that uses the new names."""
        if isinstance(qos, str):
            return self._names.get(qos, qos)
        if isinstance(qos, dict) and 'profile' in qos:
            return qos | {'profile': self._names.get(qos['profile'], qos['profile'])}
        return qos


def _beside(outer: dict[str, str], inner: dict[str, str] | None) -> dict[str, str]:
    return {old: new for old, new in (inner or {}).items() if old not in outer}


def _split(name: str, node: dict[str, Any]) -> tuple[str, str]:
    """Return the namespace and the simple name of a node."""
    if name.startswith('/'):
        namespace, _, simple = name.rpartition('/')
        return namespace or '/', simple
    return node.get('namespace', ''), name


def _full_name(namespace: str, name: str) -> str:
    return '/' + _join(namespace, name).lstrip('/')


def _join(outer: str, inner: str) -> str:
    """Return the inner namespace in the outer one; each may be absolute, relative or empty."""
    if not outer or inner.startswith('/'):
        return inner
    return f'{outer.rstrip("/")}/{inner}' if inner else outer


def _free_name(name: str, taken: Iterable[str]) -> str:
    taken = set(taken)
    while name in taken:
        name = f'{name}_'
    return name
