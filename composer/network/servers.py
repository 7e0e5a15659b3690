"""The processes that a network needs: a discovery server of Fast DDS, or routers of Zenoh."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.parsing.process_parser import parse_process
from composer.network.variables import ZENOH, router_variables

if TYPE_CHECKING:
    from collections.abc import Collection

    from composer.language.specs import HostSpec, NetworkSpec, SystemSpec

# How each process finds the others by way of one host.
SERVED = ('discovery_server', 'zenoh')
_PROGRAM = 'composer.network.discovery_server'


def with_servers(part: SystemSpec) -> SystemSpec:
    """Return the part of a host with what the network needs there; a whole system needs nothing.

    It is an external process like others, which is started again whenever it ends: those that
    found each other by a server stay together meanwhile.
    """
    network = part.network
    if network is None or not part.host:
        return part
    found = _find_server(part, network)
    if found is None:
        return part
    name, data = found
    while name in part.processes:
        name += '_'
    data = {**data, 'host': part.host, 'restart': {'when': 'always'}}
    process = parse_process(name, data, network.path)
    return replace(part, processes=MappingProxyType({name: process, **part.processes}))


def used_hosts(spec: SystemSpec) -> set[str]:
    """Return the hosts that something of a whole system runs on, its server included."""
    found = {each.host for each in spec.nodes.values()}
    found |= {each.host for each in spec.processes.values()}
    network = spec.network
    if network is not None and network.discovery in SERVED:
        found.add(network.server)
    return found - {''}


def list_sought(spec: SystemSpec, used: Collection[str]) -> list[HostSpec]:
    """Return the hosts that others look for by their addresses.

    Args:
        used: The hosts that need each other.
    """
    network, hosts = spec.network, spec.hosts
    if network is None or network.discovery == 'multicast':
        return []
    if network.discovery == 'peers':
        return [host for name, host in hosts.items() if name in used]
    is_used = any(name != network.server for name in used)
    return [hosts[network.server]] if network.server in hosts and is_used else []


def _find_server(part: SystemSpec, network: NetworkSpec) -> tuple[str, dict[str, Any]] | None:
    if network.discovery == 'zenoh':
        router = {'package': ZENOH, 'executable': 'rmw_zenohd', 'env': router_variables(part)}
        return 'zenoh_router', router
    if network.discovery == 'discovery_server' and network.server == part.host:
        command = [sys.executable, '-m', _PROGRAM, str(network.port)]
        return 'discovery_server', {'command': command}
    return None
