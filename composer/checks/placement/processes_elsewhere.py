"""Processes that something on another host waits for, or is to start."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ConditionSpec
    from composer.yaml_text.positions import DataPath


def check_processes_elsewhere(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that nothing depends on the process of another host: each host knows its own."""
    processes = context.spec.processes
    if len({each.host for each in processes.values()} - {''}) == 0:
        return
    for owner, host, conditions in _list_waiters(context):
        for each in conditions:
            if each.kind == 'process' and each.name in processes:
                yield from _check(context, each.path, f"'{owner}' waits", each.name, host)
    for process in processes.values():
        for action in process.on_exit:
            if action.start is not None and action.start in processes:
                path = (*action.path, 'start')
                yield from _check(
                    context, path, f"the end of '{process.name}'", action.start, process.host
                )


def _list_waiters(
    context: CheckContext,
) -> Iterator[tuple[str, str, tuple[ConditionSpec, ...]]]:
    for node in context.spec.nodes.values():
        yield node.name, node.host, node.wait_for
    for process in context.spec.processes.values():
        yield process.name, process.host, process.wait_for
    for component in context.spec.components:
        host = context.spec.processes[component.container].host
        yield component.name, host, component.wait_for


def _check(
    context: CheckContext, path: DataPath, who: str, name: str, host: str
) -> Iterator[Diagnostic]:
    other = context.spec.processes[name].host
    if host and other and host != other:
        starts = path[-1] == 'start'
        what = f"{who} starts '{name}'" if starts else f"{who} for '{name}'"
        yield context.at_value(
            path,
            'process-elsewhere',
            f'{what}, which runs on another host: {other}, not {host}',
            help='let both run on one host'
            if starts
            else 'wait for a node, topic, service or action of it',
        )
