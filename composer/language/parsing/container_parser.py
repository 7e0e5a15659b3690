"""Containers and their components, as data that satisfy the schema → processes and specs.

A container is a process, and stands among these from here on; one that runs already is a process
that is never started.
"""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.parameter_files import parse_parameter_files
from composer.language.parsing.condition_parser import parse_conditions
from composer.language.parsing.declared_ends import given_types, given_values, parse_own_ends
from composer.language.specs import ComponentSpec, DeclaredNodeSpec
from composer.names import expand_namespace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

# The package by which containers are asked, and its definitions: it is not always installed.
LOADING_PACKAGE = 'composition_interfaces'
LOADING_DEFINITIONS = Path(__file__).parents[2] / 'interfaces' / 'packages' / LOADING_PACKAGE

_PACKAGE = 'rclcpp_components'
_EXECUTABLE = 'component_container'
_COMPONENTS = 'components'


def is_container(process: Mapping[str, Any]) -> bool:
    """Return whether a process is a container."""
    return _COMPONENTS in process


def fold_containers(system: LoadedSystem) -> None:
    """Put the containers of a file among its processes."""
    containers = system.entries.get('containers')
    if containers is None:
        return
    data = {key: value for key, value in system.entries.items() if key != 'containers'}
    processes = data['processes'] = dict(data.get('processes', {}))
    for name, container in containers.items():
        if name in processes:
            _report_twice(system, name)
        else:
            processes[name] = _as_process(name, container)
            system.positions.move(('containers', name), ('processes', name))
    system.data = data
    for paths in (system.dropped, system.left_out, system.sampled_paths):
        inside = {path for path in paths if path[:1] == ('containers',)}
        paths.difference_update(inside)
        paths.update(('processes', *path[1:]) for path in inside)
    for path in [each for each in system.notes if each[0] == 'containers']:
        system.notes['processes', *path[1:]] = system.notes.pop(path)


def unfold_containers(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a system with containers apart from other processes, as files have it."""
    processes = data.get('processes', {})
    containers = {name: each for name, each in processes.items() if is_container(each)}
    if not containers:
        return data
    rest = {name: each for name, each in processes.items() if name not in containers}
    return {**data, 'processes': rest, 'containers': containers}


def _report_twice(system: LoadedSystem, name: str) -> None:
    from composer.diagnostics import Related, diagnostic_at

    here = system.positions.key(('containers', name))
    there = Related('the process is here', system.positions.key(('processes', name)))
    message = f"'{name}' is a process already, and containers are processes"
    system.diagnostics.append(diagnostic_at(here, 'duplicate-key', message, related=[there]))


def _as_process(name: str, container: dict[str, Any]) -> dict[str, Any]:
    *namespace, simple = name.rsplit('/', 1)
    process = {'name': simple, **container}
    if namespace:
        process |= {'namespace': namespace[0] or '/', 'external': True}
    if not (process.get('external') or 'command' in process):
        process.setdefault('package', _PACKAGE)
        process.setdefault('executable', _EXECUTABLE)
    return process


def parse_components(
    process: str, data: dict[str, Any], path: DataPath
) -> Mapping[str, ComponentSpec]:
    """Return the components of a container, by their keys."""
    return MappingProxyType(
        {
            key: _parse_component(process, key, each, (*path, _COMPONENTS, key))
            for key, each in data.get(_COMPONENTS, {}).items()
        }
    )


def _parse_component(
    process: str, key: str, data: dict[str, Any], path: DataPath
) -> ComponentSpec:
    namespace, _, name = key.rpartition('/')
    if not key.startswith('/'):
        namespace, name = data.get('namespace', ''), key
    return ComponentSpec(
        name=name,
        namespace=expand_namespace(namespace),
        description=data.get('description', ''),
        package=data['package'],
        plugin=data['plugin'],
        parameters=MappingProxyType(given_values(data.get('parameters', {}))),
        types=MappingProxyType(given_types(data.get('parameters', {}))),
        parameter_files=parse_parameter_files(data),
        remap=tuple(data.get('remap', {}).items()),
        log_level=data.get('log_level'),
        intra_process=data.get('intra_process', False),
        extra_arguments=MappingProxyType(data.get('extra_arguments', {})),
        is_named='name' not in data,
        wait_for=parse_conditions(data, path),
        lifecycle=data.get('lifecycle'),
        container=process,
        path=path,
    )


def declare_component(component: ComponentSpec, data: dict[str, Any]) -> DeclaredNodeSpec:
    """Return what is known of the node that a component is.

    Args:
        data: The component as the file has it.
    """
    is_declared, sections, parameters = parse_own_ends(data, component.path)
    return DeclaredNodeSpec(
        name=component.name,
        is_named=component.is_named,
        namespace=component.namespace,
        remap=component.remap,
        sections=sections if is_declared else None,
        parameters=parameters,
        declares_all_parameters=False,
        process=component.container,
        path=component.path,
    )
