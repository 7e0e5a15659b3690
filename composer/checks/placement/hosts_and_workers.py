"""The names of workers and hosts, and whether each thing can be where it is said to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.spelling import did_you_mean, find_nearest, is_typo, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec, ProcessSpec, WorkerSpec
    from composer.yaml_text.positions import DataPath

_SECTIONS = ('workers', 'nodes', 'processes')


def check_hosts(context: CheckContext) -> Iterator[Diagnostic]:
    """Check the hosts that are named against the inventory."""
    hosts = context.spec.hosts
    if not hosts or context.was_dropped(('hosts',)):
        return
    for path, name in _list_named_hosts(context):
        if name not in hosts and not context.was_dropped(('hosts', name)):
            yield context.at_value(
                path,
                'unknown-host',
                f"there is no host '{name}' in the inventory",
                help=suggest(name, hosts, 'there are'),
            )


def check_workers(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that each worker is on one host, and is one that nodes have."""
    if not context.spec.workers:
        return
    named = _find_named_workers(context)
    written = context.system.filled.get('workers', {})
    placed = _group_placed_nodes(context)
    for worker in context.spec.workers.values():
        yield from _check_host_of(context, worker, placed.get(worker.name, {}))
        if worker.name not in named:
            yield from _check_use(context, worker, named)
        elif worker.name not in written:
            yield from _check_spelling(context, worker, written.keys() & named)


def find_unplaced(context: CheckContext) -> Iterator[Diagnostic]:
    """Yield the nodes and processes without a host: a system that is deployed has none."""
    hosts = context.spec.hosts
    listed = f'the inventory has {", ".join(hosts)}' if hosts else 'name the hosts under hosts:'
    entries: list[NodeSpec | ProcessSpec] = [
        *context.spec.nodes.values(),
        *context.spec.processes.values(),
    ]
    for entry in entries:
        if not entry.host:
            noun = 'node' if entry.path[0] == 'nodes' else 'process'
            yield context.at_key(
                entry.path,
                'no-host',
                f"the {noun} '{entry.name}' has no host to run on",
                help=f"write 'host: NAME' here, or 'defaults: {{host: NAME}}' for all; {listed}",
            )


def _list_named_hosts(context: CheckContext) -> Iterator[tuple[DataPath, str]]:
    for section in _SECTIONS:
        for key, entry in context.system.filled.get(section, {}).items():
            if entry.get('host'):
                yield (section, key, 'host'), entry['host']
    network = context.spec.network
    if network is not None and network.server:
        yield (*network.path, 'server'), network.server


def _find_named_workers(context: CheckContext) -> dict[str, None]:
    """Return the workers that nodes have, those of nodes that are left out, too."""
    unused = context.system.unused
    nodes = [*context.spec.nodes.values(), *(unused.nodes.values() if unused else ())]
    return {node.worker: None for node in nodes if node.worker}


def _group_placed_nodes(context: CheckContext) -> dict[str, dict[str, str]]:
    """Return the hosts that the nodes of each worker have of their own, by their keys."""
    placed: dict[str, dict[str, str]] = {}
    for key, node in context.system.filled.get('nodes', {}).items():
        if node.get('worker') and node.get('host'):
            placed.setdefault(node['worker'], {})[key] = node['host']
    return placed


def _check_host_of(
    context: CheckContext, worker: WorkerSpec, placed: dict[str, str]
) -> Iterator[Diagnostic]:
    """Check that the nodes of a worker are on one host: that of the worker, if it has one."""
    declared = context.system.filled.get('workers', {}).get(worker.name, {}).get('host')
    for key, host in placed.items():
        if host == worker.host:
            continue
        origin = worker.path if declared else ('nodes', next(iter(placed)))
        yield context.at_value(
            ('nodes', key, 'host'),
            'conflicting-hosts',
            f"worker '{worker.name}' is on host '{worker.host}', and its node '{key}' cannot be "
            f"on '{host}'",
            help="give the node another worker, or the worker one host under 'workers:'",
            related=[context.related_value((*origin, 'host'), 'the host of the worker is here')],
        )


def _check_use(
    context: CheckContext, worker: WorkerSpec, named: dict[str, None]
) -> Iterator[Diagnostic]:
    # What is missing because of an error may be what uses it.
    if not any(path[:1] in ((), ('nodes',), ('include',)) for path in context.system.dropped):
        yield context.at_key(
            worker.path,
            'unused-worker',
            f"no node runs in the worker '{worker.name}'",
            help=suggest(worker.name, named, 'nodes run in', 'remove it, or name it in a node'),
        )


def _check_spelling(
    context: CheckContext, worker: WorkerSpec, declared: Iterable[str]
) -> Iterator[Diagnostic]:
    meant = find_nearest(worker.name, declared)
    if meant is not None and is_typo(worker.name, meant):
        yield context.at_value(
            worker.path,
            'likely-misspelling',
            f"no worker '{worker.name}' is declared, but '{meant}' is",
            help=did_you_mean(meant),
        )
