"""A system and its nodes, as data that satisfy the schema → their specs."""

from __future__ import annotations

import marshal
from dataclasses import MISSING, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import NODE_BEHAVIOURS
from composer.language.loaded_system import PARTS
from composer.language.parameter_files import parse_parameter_files
from composer.language.parsing.condition_parser import parse_conditions
from composer.language.parsing.container_parser import (
    LOADING_DEFINITIONS,
    LOADING_PACKAGE,
    is_container,
)
from composer.language.parsing.entity_parser import parse_entities, parse_run_options
from composer.language.parsing.entry_parser import (
    Data,
    Spec,
    parse_behaviour,
    parse_entries,
    parse_qos,
)
from composer.language.parsing.parameter_references import fill_in
from composer.language.parsing.process_parser import parse_process
from composer.language.parsing.worker_parser import (
    create_host_finder,
    parse_hosts,
    parse_network,
    parse_workers,
    with_hosts,
)
from composer.language.specs import (
    DEFAULT_DIAGNOSTICS_PERIOD_SEC,
    DEFAULT_SHUTDOWN_TIMEOUT_SEC,
    BehaviourSpec,
    LifecycleStart,
    NodeSpec,
    QosSpec,
    SystemSpec,
)
from composer.language.values.start_values import StartValues, fill_start_values
from composer.names import expand_namespace
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.diagnostics import Span
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import ProcessSpec
    from composer.yaml_text.positions import DataPath

# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_DEPTH_OF_ENTITIES = 4
_BOND = 'bond'
_PACKAGES = Path(__file__).parents[2] / 'interfaces' / 'packages'
# The last version in which equal data are written alike, whoever else holds them.
_MARSHAL_VERSION = 2
_PLAIN_KEYS = [each.name for each in fields(NodeSpec) if each.default is not MISSING]


def parse_specs(system: LoadedSystem, before: LoadedSystem | None = None) -> None:
    """Parse the data of a system; what is left out becomes a system of its own.

    Both have the QoS profiles and interfaces.

    Args:
        before: A system whose nodes and processes are kept where the data are the same.
    """
    # Files and folders are named after it: '.' and '..' would be others.
    name = system.path.stem if system.path.stem.strip('.') else 'system'
    used = dict(system.entries)
    if system.left_out:
        unused = dict(used)
        for section in PARTS:
            entries = used.get(section, {})
            used[section] = {
                k: v for k, v in entries.items() if (section, k) not in system.left_out
            }
            if section in ('nodes', 'processes'):
                unused[section] = {k: v for k, v in entries.items() if k not in used[section]}
        _leave_out_entities(system, used, unused)
        samples = StartValues()
        filled = _fill(system, unused, samples, system.sampled_unused)
        system.unused = parse_system(filled, name)
    system.data = used
    _drop_inherited_hosts(system)
    system.filled = _fill(system, used, system.start, system.sampled)
    system.spec = fill_in(system, parse_system(system.filled, name, before))


def _fill(
    system: LoadedSystem, data: Data, start: StartValues, sampled: list[Span]
) -> dict[str, Any]:
    find_host = create_host_finder(data)
    return fill_start_values(data, system.positions, start, sampled, find_host)


def _drop_inherited_hosts(system: LoadedSystem) -> None:
    """Take the hosts of defaults and includes from nodes whose worker has one of its own."""
    entries = system.entries
    workers, nodes = entries.get('workers', {}), entries.get('nodes', {})
    if not (system.inherited and workers and nodes):
        return
    nodes = entries['nodes'] = dict(nodes)
    for path in system.inherited:
        node = nodes.get(str(path[1]), {}) if path[0] == 'nodes' else {}
        if workers.get(node.get('worker'), {}).get('host'):
            nodes[str(path[1])] = {key: node[key] for key in node if key != 'host'}
            system.positions.remove(path)


def _leave_out_entities(
    system: LoadedSystem, used: dict[str, Any], unused: dict[str, Any]
) -> None:
    """Take entities that are left out of their nodes; with them, these nodes are unused."""
    for path in system.left_out:
        owners = used.get(str(path[0]), {})
        if len(path) != _DEPTH_OF_ENTITIES or path[1] not in owners:
            continue
        outer, name, section, entity = path
        unused[str(outer)].setdefault(name, owners[name])
        if entity in (rest := owners[name].get(section, {})):
            without = {key: rest[key] for key in rest if key != entity}
            owners[name] = {**owners[name], section: without}


def parse_system(data: Data, name: str, before: LoadedSystem | None = None) -> SystemSpec:
    """Return the system that the data describe.

    Args:
        data: As the schema wants them.
        name: The file's name without its ending.
        before: See `parse_specs`.
    """
    executor = data.get('executor', {})
    packages = data.get('interfaces', {})
    interfaces = {
        name: entry if isinstance(entry, str) else entry['folder']
        for name, entry in packages.items()
    }
    if any(map(is_container, data.get('processes', {}).values())):
        interfaces = {LOADING_PACKAGE: str(LOADING_DEFINITIONS)} | interfaces
    if any(node.get('bond') for node in data.get('nodes', {}).values()):
        # It is on no package index.
        interfaces = {_BOND: str(_PACKAGES / _BOND)} | interfaces
    workers = parse_workers(data)
    return SystemSpec(
        name=name,
        description=data.get('description', ''),
        interfaces=MappingProxyType(interfaces),
        listed_interfaces=MappingProxyType(
            {
                name: tuple(entry['only'])
                for name, entry in packages.items()
                if isinstance(entry, dict) and 'only' in entry
            }
        ),
        qos=parse_entries(data, (), 'qos', _parse_named_qos),
        threads=int(executor['threads']) if 'threads' in executor else None,
        shutdown_timeout_sec=float(executor.get('shutdown_timeout', DEFAULT_SHUTDOWN_TIMEOUT_SEC)),
        diagnostics_period_sec=_parse_diagnostics(data.get('diagnostics', True)),
        nodes=with_hosts(
            parse_entries(data, (), 'nodes', _keeping(before, 'nodes', parse_node)), data, workers
        ),
        environment=MappingProxyType(
            {name: format_scalar(value) for name, value in data.get('environment', {}).items()}
        ),
        processes=_with_demand(
            parse_entries(data, (), 'processes', _keeping(before, 'processes', parse_process))
        ),
        workers=workers,
        hosts=parse_hosts(data),
        network=parse_network(data.get('network')),
    )


def _with_demand(processes: Mapping[str, ProcessSpec]) -> Mapping[str, ProcessSpec]:
    """Return processes that know whether the end of another one starts them."""
    started = {each.start for process in processes.values() for each in process.on_exit}
    return MappingProxyType(
        {
            name: each
            if each.on_demand == (name in started)
            else replace(each, on_demand=name in started)
            for name, each in processes.items()
        }
    )


def _keeping(
    before: LoadedSystem | None, section: str, parse: Callable[[str, Any, DataPath], Spec]
) -> Callable[[str, Any, DataPath], Spec]:
    """Return a parser that returns the records of before where their data are the same."""
    if before is None or before.spec is None:
        return parse
    specs: Mapping[str, Spec] = getattr(before.spec, section)
    written = before.filled.get(section, {})

    def parse_changed(name: str, data: Any, path: DataPath) -> Spec:
        known = specs.get(name)
        return known if known and _is_same(written[name], data) else parse(name, data, path)

    return parse_changed


def _is_same(old: Any, new: Any) -> bool:
    """Return whether data are the same: in types (`1` equals `True`) and in order, too."""
    try:
        return old == new and marshal.dumps(old, _MARSHAL_VERSION) == marshal.dumps(
            new, _MARSHAL_VERSION
        )
    except (RecursionError, ValueError):
        return False


def _parse_diagnostics(data: bool | Data) -> float | None:  # noqa: FBT001 - as it is written
    if data is False:
        return None
    period = data.get('period') if isinstance(data, dict) else None
    return DEFAULT_DIAGNOSTICS_PERIOD_SEC if period is None else float(period)


def _parse_named_qos(name: str, data: Data, path: DataPath) -> QosSpec:  # noqa: ARG001 - a parser of entries
    return parse_qos(data, path)


def parse_node(key: str, data: Data, path: DataPath) -> NodeSpec:
    """Return the node that the file calls `key`, which may be its full name."""
    namespace, _, name = key.rpartition('/')
    if not key.startswith('/'):
        namespace, name = expand_namespace(data.get('namespace', '')), key
    return NodeSpec(
        name=name,
        namespace=namespace or '/',
        state=MappingProxyType(data.get('state', {})),
        remap=tuple(data.get('remap', {}).items()),
        lifecycle=_parse_lifecycle(data.get('lifecycle', False)),
        wait_for=parse_conditions(data, path),
        delay_sec=float(data.get('delay', 0.0)),
        parameter_files=parse_parameter_files(data),
        followed=(),
        path=path,
        **{key: data[key] for key in _PLAIN_KEYS if key in data},
        **_parse_hooks(data, path),
        **parse_entities(data, path),
        **parse_run_options({}, data),
    )


def _parse_hooks(data: Data, path: DataPath) -> dict[str, Any]:
    return {each.key: _parse_hook(data, path, each.key) for each in NODE_BEHAVIOURS}


def _parse_lifecycle(data: bool | Data) -> LifecycleStart | None:  # noqa: FBT001 - as it is written
    if data is False:
        return None
    full: Data = data if isinstance(data, dict) else {}
    start: LifecycleStart = full.get('start', 'unconfigured')
    return start


def _parse_hook(node: Data, path: DataPath, key: str) -> BehaviourSpec | None:
    data = node.get(key)
    if not isinstance(data, str):
        return parse_behaviour(data, (*path, key)) if data else None
    spec = parse_behaviour({'behaviour': data}, path)
    return spec and replace(spec, path=(*path, key))
