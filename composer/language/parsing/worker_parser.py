"""Workers, hosts and the network as data that satisfy the schema → specs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.parsing.entry_parser import Data, parse_entries
from composer.language.specs import (
    DEFAULT_HOST_FOLDER,
    DEFAULT_RESTART_DELAY_SEC,
    DEFAULT_ROUTER_PORT,
    DEFAULT_SERVER_PORT,
    HostSpec,
    NetworkSpec,
    NodeSpec,
    WorkerSpec,
)
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.yaml_text.positions import DataPath


def parse_workers(data: Data) -> Mapping[str, WorkerSpec]:
    """Return all workers of a system, those that only its nodes name, too.

    One without a host is on that of its nodes.
    """
    workers = dict(parse_entries(data, (), 'workers', _parse_worker))
    for key, node in data.get('nodes', {}).items():
        name, host = node.get('worker'), node.get('host', '')
        if name and name not in workers:
            workers[name] = _parse_worker(name, {}, ('nodes', key, 'worker'))
        if name and host and not workers[name].host:
            workers[name] = replace(workers[name], host=host)
    return MappingProxyType(workers)


def with_hosts(
    nodes: Mapping[str, NodeSpec], data: Data, workers: Mapping[str, WorkerSpec]
) -> Mapping[str, NodeSpec]:
    """Return nodes, each of which has its own host or else that of its worker."""
    placed = dict(nodes)
    for key, node in nodes.items():
        host = data['nodes'][key].get('host', '')
        if not host and node.worker:
            host = workers[node.worker].host
        if node.host != host:
            placed[key] = replace(node, host=host)
    return MappingProxyType(placed)


def create_host_finder(data: Data) -> Callable[[DataPath], str]:
    """Return a function that returns the host of the node or process that a path leads into."""

    @cache
    def workers() -> Mapping[str, WorkerSpec]:
        return parse_workers(data)

    def find(path: DataPath) -> str:
        if path[0] not in ('nodes', 'processes'):
            return ''
        entry = data[str(path[0])][path[1]]
        host: str = entry.get('host', '')
        is_in_worker = path[0] == 'nodes' and not host and entry.get('worker')
        return workers()[entry['worker']].host if is_in_worker else host

    return find


def parse_hosts(data: Data) -> Mapping[str, HostSpec]:
    """Return the inventory of a system."""
    return parse_entries(data, (), 'hosts', _parse_host)


def parse_network(data: str | Data | None) -> NetworkSpec | None:
    """Return what a file says of the network, if it does."""
    if data is None:
        return None
    full: Data = {'discovery': data} if isinstance(data, str) else data
    discovery = full.get('discovery', 'multicast')
    port = DEFAULT_ROUTER_PORT if discovery == 'zenoh' else DEFAULT_SERVER_PORT
    return NetworkSpec(
        discovery=discovery,
        domain_id=full.get('domain_id'),
        peers=tuple(full.get('peers', ())),
        server=full.get('server', ''),
        port=full.get('port', port),
        path=('network',),
    )


def _parse_worker(name: str, data: Data, path: DataPath) -> WorkerSpec:
    restart: dict[str, Any] = data.get('restart', {})
    return WorkerSpec(
        name=name,
        description=data.get('description', ''),
        cpus=tuple(data.get('cpus', ())),
        nice=data.get('nice'),
        threads=data.get('threads'),
        environment=MappingProxyType(
            {key: format_scalar(value) for key, value in data.get('environment', {}).items()}
        ),
        restart=restart.get('when', 'on_failure'),
        restart_delay_sec=float(restart.get('delay', DEFAULT_RESTART_DELAY_SEC)),
        most_restarts=restart.get('max'),
        required=data.get('required', False),
        host=data.get('host', ''),
        log_level=data.get('log_level'),
        path=path,
    )


def _parse_host(name: str, data: Data, path: DataPath) -> HostSpec:
    return HostSpec(
        name=name,
        description=data.get('description', ''),
        address=data.get('address', name),
        user=data.get('user', ''),
        port=data.get('port'),
        python=data.get('python', 'python3'),
        identity_file=data.get('identity_file', ''),
        folder=data.get('folder', DEFAULT_HOST_FOLDER),
        systemd=data.get('systemd', 'user'),
        path=path,
    )
