"""Processes, and what they and nodes wait for: plain data that satisfy the schema → specs."""

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

if TYPE_CHECKING:
    from composer.language.positions import DataPath
    from composer.language.specs import ConditionKind

_CONDITION_KINDS: tuple[ConditionKind, ...] = ('topic', 'service', 'action', 'node', 'process')


# What makes a process one of ROS.
_FOR_ROS = ('package', 'name', 'namespace', 'parameters', 'parameter_files', 'remap', 'log_level')


def is_ros_process(data: dict[str, Any]) -> bool:
    """Return whether a process takes arguments for ROS: a bare command may be any program."""
    return any(key in data for key in _FOR_ROS)


def parse_process(
    outer_namespace: str | None, name: str, data: dict[str, Any], path: DataPath
) -> ProcessSpec:
    """Return a process.

    Args:
        outer_namespace: That of the file's defaults, `None` if they have none.
    """
    restart = data.get('restart', {'when': 'never'})
    stop = data.get('stop', {})
    return ProcessSpec(
        name=name,
        description=data.get('description', ''),
        command=tuple(map(write_scalar, data.get('command', ()))),
        package=data.get('package'),
        executable=data.get('executable'),
        arguments=tuple(map(write_scalar, data.get('arguments', ()))),
        node_name=data.get('name'),
        namespace=_parse_namespace(outer_namespace, data),
        parameters=MappingProxyType(data.get('parameters', {})),
        parameter_files=tuple(data.get('parameter_files', ())),
        remap=tuple(data.get('remap', {}).items()),
        log_level=data.get('log_level'),
        env=MappingProxyType(
            {key: write_scalar(value) for key, value in data.get('env', {}).items()}
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


def write_scalar(value: Any) -> str:
    """Return a value as a program gets it: as YAML would write it."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    return str(value)


def _parse_condition(data: dict[str, Any], path: DataPath) -> ConditionSpec:
    kind = next(each for each in _CONDITION_KINDS if each in data)
    timeout_sec = float(data.get('timeout', DEFAULT_WAIT_SEC))
    return ConditionSpec(kind, data[kind], timeout_sec, (*path, kind))


def _parse_namespace(outer: str | None, data: dict[str, Any]) -> str | None:
    if 'namespace' in data:
        return expand_namespace(data['namespace'], outer or '/')
    return outer if is_ros_process(data) else None
