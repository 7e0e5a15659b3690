"""Processes and `wait_for` as data that satisfy the schema → specs."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.specs import (
    DEFAULT_RESTART_DELAY_SEC,
    DEFAULT_WAIT_SEC,
    ConditionSpec,
    ProcessSpec,
)
from composer.names import expand_namespace
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import ConditionKind
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
_CONDITION_KINDS: tuple[ConditionKind, ...] = ('topic', 'service', 'action', 'node', 'process')


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
    """Return a node or process with the names in its `wait_for` changed.

    Args:
        processes: New names of processes.
        namespace: Where relative names of all else lie.
    """
    written = entry.get('wait_for')
    if not written:
        return entry

    def renamed(condition: dict[str, Any]) -> dict[str, Any]:
        kind = _kind_of(condition)
        name = condition[kind]
        if kind == 'process':
            return condition | {kind: processes.get(name, name)}
        is_relative = namespace and not name.startswith(('/', '~'))
        return condition | {kind: f'{namespace.rstrip("/")}/{name}'} if is_relative else condition

    if isinstance(written, dict):
        return entry | {'wait_for': renamed(written)}
    return entry | {'wait_for': [renamed(each) for each in written]}


def parse_process(name: str, data: dict[str, Any], path: DataPath) -> ProcessSpec:
    """Return a process."""
    restart = data.get('restart', {'when': 'never'})
    stop = data.get('stop', {})
    return ProcessSpec(
        name=name,
        description=data.get('description', ''),
        command=tuple(map(format_scalar, data.get('command', ()))),
        package=data.get('package'),
        executable=data.get('executable'),
        arguments=tuple(map(format_scalar, data.get('arguments', ()))),
        node_name=data.get('name'),
        namespace=expand_namespace(data['namespace']) if 'namespace' in data else None,
        parameters=MappingProxyType(data.get('parameters', {})),
        parameter_files=tuple(data.get('parameter_files', ())),
        remap=tuple(data.get('remap', {}).items()),
        log_level=data.get('log_level'),
        env=MappingProxyType(
            {key: format_scalar(value) for key, value in data.get('env', {}).items()}
        ),
        cwd=data.get('cwd'),
        required=data.get('required', False),
        restart=restart.get('when', 'on_failure'),
        restart_delay_sec=float(restart.get('delay', DEFAULT_RESTART_DELAY_SEC)),
        most_restarts=restart.get('max'),
        stop_signal=stop.get('signal', 'SIGINT'),
        stop_timeout_sec=float(stop['timeout']) if 'timeout' in stop else None,
        wait_for=parse_conditions(data, path),
        path=path,
    )


def parse_conditions(data: dict[str, Any], path: DataPath) -> tuple[ConditionSpec, ...]:
    """Return what a node or process waits for."""
    written = data.get('wait_for', [])
    at = (*path, 'wait_for')
    if isinstance(written, dict):
        return (_parse_condition(written, at),)
    return tuple(_parse_condition(each, (*at, index)) for index, each in enumerate(written))


def _parse_condition(data: dict[str, Any], path: DataPath) -> ConditionSpec:
    kind = _kind_of(data)
    timeout_sec = float(data.get('timeout', DEFAULT_WAIT_SEC))
    return ConditionSpec(kind, data[kind], data.get('state'), timeout_sec, (*path, kind))


def _kind_of(condition: dict[str, Any]) -> ConditionKind:
    return next(each for each in _CONDITION_KINDS if each in condition)
