"""Processes as data that satisfy the schema → specs."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.parameter_files import parse_parameter_files
from composer.language.parsing.condition_parser import kind_of, parse_conditions
from composer.language.parsing.container_parser import declare_component, parse_components
from composer.language.parsing.declared_ends import given_values, parse_declared_nodes
from composer.language.parsing.entry_parser import behaviour_at, parse_behaviour
from composer.language.specs import (
    DEFAULT_LAUNCH_STOP_SEC,
    DEFAULT_RESTART_DELAY_SEC,
    ExitActionSpec,
    ProcessSpec,
)
from composer.names import expand_namespace
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.yaml_text.positions import DataPath

# What only a program of ROS is given; executables of packages are such programs.
_ROS_KEYS = (
    'package',
    'name',
    'namespace',
    'parameters',
    'parameter_files',
    'remap',
    'log_level',
)


def takes_ros_arguments(data: dict[str, Any]) -> bool:
    """Return whether a process takes ROS arguments; a plain command may not."""
    return any(key in data for key in _ROS_KEYS)


def with_defaults(process: dict[str, Any], defaults: dict[str, Any]) -> dict[str, Any]:
    """Return a process with the defaults of its file, except the namespace."""
    if not takes_ros_arguments(process):
        return process
    full = dict(process)
    if 'log_level' in defaults:
        full.setdefault('log_level', defaults['log_level'])
    if defaults.get('use_sim_time'):
        full['parameters'] = {'use_sim_time': True} | process.get('parameters', {})
    return full


def with_waits(
    entry: dict[str, Any], processes: Mapping[str, str], namespace: str = ''
) -> dict[str, Any]:
    """Return a node or process with the names in its `wait_for` and `on_exit` changed.

    Args:
        processes: New names of processes.
        namespace: Where relative names of all else lie.
    """

    def renamed(condition: dict[str, Any]) -> dict[str, Any]:
        kind = kind_of(condition)
        name = condition[kind]
        if kind == 'process':
            return condition | {kind: processes.get(name, name)}
        is_relative = namespace and not name.startswith(('/', '~'))
        return condition | {kind: f'{namespace.rstrip("/")}/{name}'} if is_relative else condition

    def restarted(action: Any) -> Any:
        if not isinstance(action, dict) or 'start' not in action:
            return action
        return action | {'start': processes.get(action['start'], action['start'])}

    if 'components' in entry:
        components = entry['components'].items()
        waiting = {key: with_waits(each, processes, namespace) for key, each in components}
        entry = entry | {'components': waiting}
    for key, change in (('wait_for', renamed), ('on_exit', restarted)):
        if written := entry.get(key):
            is_list = isinstance(written, list)
            entry = entry | {key: [*map(change, written)] if is_list else change(written)}
    return entry


def parse_process(name: str, data: dict[str, Any], path: DataPath) -> ProcessSpec:
    """Return a process."""
    restart = data.get('restart', {'when': 'never'})
    stop = data.get('stop', {})
    nodes, declares_all_ends = parse_declared_nodes(name, data, path)
    components = parse_components(name, data, path)
    loaded = [declare_component(each, data['components'][key]) for key, each in components.items()]
    if loaded and not data.get('external'):
        # Nobody else loads anything into it.
        declares_all_ends = all(each.sections is not None for each in loaded)
    return ProcessSpec(
        name=name,
        description=data.get('description', ''),
        command=tuple(map(format_scalar, data.get('command', ()))),
        package=data.get('package'),
        executable=data.get('executable'),
        launch=data.get('launch'),
        arguments=tuple(_arguments_of(data)),
        node_name=data.get('name'),
        namespace=expand_namespace(data['namespace']) if 'namespace' in data else None,
        parameters=MappingProxyType(given_values(data.get('parameters', {}))),
        parameter_files=parse_parameter_files(data),
        remap=tuple(data.get('remap', {}).items()),
        log_level=data.get('log_level'),
        env=MappingProxyType(
            {key: format_scalar(value) for key, value in data.get('env', {}).items()}
        ),
        cwd=data.get('cwd'),
        restart=restart.get('when', 'on_failure'),
        restart_delay_sec=float(restart.get('delay', DEFAULT_RESTART_DELAY_SEC)),
        most_restarts=restart.get('max'),
        on_exit=_parse_exit_actions(data, path),
        stop_signal=stop.get('signal', 'SIGINT'),
        stop_timeout_sec=_stop_timeout_sec(data),
        wait_for=parse_conditions(data, path),
        delay_sec=float(data.get('delay', 0.0)),
        on_demand=False,
        nodes=tuple(replace(each, host=data.get('host', '')) for each in (*nodes, *loaded)),
        declares_all_ends=declares_all_ends,
        lifecycle=data.get('lifecycle'),
        components=components,
        external=data.get('external', False),
        host=data.get('host', ''),
        path=path,
    )


def _parse_exit_actions(data: dict[str, Any], path: DataPath) -> tuple[ExitActionSpec, ...]:
    written, at = data.get('on_exit', []), (*path, 'on_exit')
    if not isinstance(written, list):
        return (_parse_exit_action(written, at),)
    return tuple(_parse_exit_action(each, (*at, index)) for index, each in enumerate(written))


def _parse_exit_action(data: str | dict[str, Any], path: DataPath) -> ExitActionSpec:
    if isinstance(data, dict):
        return ExitActionSpec(parse_behaviour(data, path), data.get('start'), path)
    if data == 'shutdown':
        return ExitActionSpec(None, None, path)
    behaviour = behaviour_at({'behaviour': data}, path)
    return ExitActionSpec(replace(behaviour, path=path), None, path)


def _arguments_of(data: dict[str, Any]) -> Iterator[str]:
    written = data.get('arguments', ())
    if isinstance(written, dict):
        yield from (f'{name}:={format_scalar(value)}' for name, value in written.items())
    else:
        yield from map(format_scalar, written)


def _stop_timeout_sec(data: dict[str, Any]) -> float | None:
    default = DEFAULT_LAUNCH_STOP_SEC if 'launch' in data else None
    written = data.get('stop', {}).get('timeout', default)
    return None if written is None else float(written)
