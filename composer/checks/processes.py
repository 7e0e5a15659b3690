"""Processes, what is waited for, and the environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.ament import ament_prefixes, list_executables, list_packages
from composer.checks.graph import full_name
from composer.names import (
    did_you_mean,
    expand_name,
    find_namespace_fault,
    find_node_name_fault,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.checks.graph import ChannelKind
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ConditionSpec, NodeSpec, ProcessSpec

_RMW_INDEX = 'share/ament_index/resource_index/rmw_typesupport'
# What of that index are no middlewares themselves.
_NO_RMW = ('rmw_implementation',)
# The highest domain whose ports exist (https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html).
_MAX_DOMAIN = 232


def check_processes(context: CheckContext) -> Iterator[Diagnostic]:
    """Names in processes follow ROS's rules."""
    for process in context.spec.processes.values():
        yield from _check_process_names(context, process)


def check_executables(context: CheckContext) -> Iterator[Diagnostic]:
    """The packages and executables of processes are installed.

    Those that are left out by their `when` need not be: a driver is where its device is.
    """
    for process in context.spec.processes.values():
        yield from _check_executable(context, process)


def _check_process_names(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    path = process.path
    fault = find_node_name_fault(process.node_name) if process.node_name is not None else None
    if fault:
        message = f"'{process.node_name}' cannot name a node: {fault}"
        yield context.at_value((*path, 'name'), 'bad-name', message)
    fault = find_namespace_fault(process.namespace) if process.namespace else None
    if fault:
        message = f"'{process.namespace}': {fault}"
        yield context.at_value((*path, 'namespace'), 'bad-name', message)


def _check_executable(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    packages = list_packages()
    if process.package is None or not packages:
        return
    if process.package not in packages:
        yield context.at_value(
            (*process.path, 'package'),
            'missing-package',
            f"no package '{process.package}' is installed",
            help=did_you_mean(process.package, packages),
        )
        return
    names = [path.name for path in list_executables(process.package)]
    if process.executable not in names:
        yield context.at_value(
            (*process.path, 'executable'),
            'unknown-executable',
            f"'{process.package}' has no executable '{process.executable}'",
            help=did_you_mean(process.executable or '', names, 'it has') or 'it has none',
        )


def check_environment(context: CheckContext) -> Iterator[Diagnostic]:
    """The variables that ROS reads have values that it takes."""
    environment = context.spec.environment
    domain = environment.get('ROS_DOMAIN_ID')
    if domain is not None and not (domain.isdecimal() and int(domain) <= _MAX_DOMAIN):
        yield context.at_value(
            ('environment', 'ROS_DOMAIN_ID'),
            'bad-environment',
            f'ROS_DOMAIN_ID is a number from 0 to {_MAX_DOMAIN}, not {domain!r}',
        )
    middleware = environment.get('RMW_IMPLEMENTATION')
    installed = installed_middlewares()
    if middleware is not None and installed and middleware not in installed:
        yield context.at_value(
            ('environment', 'RMW_IMPLEMENTATION'),
            'bad-environment',
            f"no middleware '{middleware}' is installed",
            help=did_you_mean(middleware, installed, 'there are'),
        )


def installed_middlewares() -> list[str]:
    """Return the RMW implementations that ROS can load; none where there is no ROS."""
    folders = [prefix / _RMW_INDEX for prefix in ament_prefixes()]
    names = {entry.name for folder in folders if folder.is_dir() for entry in folder.iterdir()}
    return sorted(names.difference(_NO_RMW))


def check_waits(context: CheckContext) -> Iterator[Diagnostic]:
    """What is waited for can come: processes are declared, and nobody waits for itself."""
    processes = context.spec.processes
    for waiter in _waiters(context):
        for condition in waiter.wait_for:
            lost = context.was_dropped(('processes',)) or context.was_dropped(
                ('processes', condition.name)
            )
            if condition.kind == 'process' and condition.name not in processes and not lost:
                yield context.at_value(
                    condition.path,
                    'unknown-process',
                    f"there is no process '{condition.name}' in this system",
                    help=did_you_mean(condition.name, processes),
                )
    yield from _find_cycles(context)


def _waiters(context: CheckContext) -> Iterable[NodeSpec | ProcessSpec]:
    return (*context.spec.nodes.values(), *context.spec.processes.values())


def _find_cycles(context: CheckContext) -> Iterator[Diagnostic]:
    """Yield one finding for each round of nodes and processes that wait for each other."""
    providers = _Providers(context)
    edges = {
        waiter.path: [
            (condition, path)
            for condition in waiter.wait_for
            for path in providers.of(waiter, condition)
        ]
        for waiter in _waiters(context)
    }
    done: set[tuple[str | int, ...]] = set()
    for start, first in edges.items():
        trail: list[tuple[str | int, ...]] = []
        pending = [(start, iter(first))] if start not in done else []
        while pending:
            path, others = pending[-1]
            if path not in trail:
                trail.append(path)
            condition, target = next(others, (None, None))
            if condition is None or target is None:
                done.add(path)
                trail.remove(path)
                pending.pop()
            elif target in trail:
                names = [str(each[-1]) for each in trail[trail.index(target) :]]
                way = ' → '.join([*names, names[0]])
                message = f'{way}: these wait for each other, and none of them ever starts'
                yield context.at_value(condition.path, 'wait-cycle', message)
            elif target not in done:
                pending.append((target, iter(edges.get(target, ()))))


class _Providers:
    """Which nodes and processes of a system bring what is waited for."""

    def __init__(self, context: CheckContext) -> None:
        self._spec = context.spec
        self._nodes = {node.full_name: node.path for node in context.spec.nodes.values()}
        self._channels: dict[tuple[str, str], list[tuple[str | int, ...]]] = {}
        for node in context.spec.nodes.values():
            for publisher in node.publishers.values():
                self._add(node, 'topic', publisher.topic)
            for service in node.services.values():
                self._add(node, 'service', service.service)
            for action in node.actions.values():
                self._add(node, 'action', action.action)

    def of(
        self, waiter: NodeSpec | ProcessSpec, condition: ConditionSpec
    ) -> list[tuple[str | int, ...]]:
        """Return the paths of all who bring what a condition asks for, if it is only one."""
        kind = condition.kind
        if kind == 'process':
            process = self._spec.processes.get(condition.name)
            return [process.path] if process else []
        if kind == 'node':
            name = expand_name(condition.name, waiter.name, waiter.namespace or '/')
            path = self._nodes.get(name)
            return [path] if path else []
        found = self._channels.get((kind, full_name(waiter, kind, condition.name)), [])
        # Of several, any one will do.
        return found if len(found) == 1 else []

    def _add(self, node: NodeSpec, kind: ChannelKind, name: str) -> None:
        self._channels.setdefault((kind, full_name(node, kind, name)), []).append(node.path)
