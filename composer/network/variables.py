"""`network:` → the environment variables with which ROS starts.

ROS has a variable for all that is needed, except for Zenoh, which has its own:
https://docs.ros.org/en/jazzy/Tutorials/Advanced/Improved-Dynamic-Discovery.html,
https://fast-dds.docs.eprosima.com/en/v2.14.1/fastdds/env_vars/env_vars.html and
https://github.com/ros2/rmw_zenoh.
"""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

from composer.language.specs import DEFAULT_ROUTER_PORT

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import Discovery, NetworkSpec, SystemSpec

PEERS = 'ROS_STATIC_PEERS'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
SERVER = 'ROS_DISCOVERY_SERVER'
ZENOH = 'rmw_zenoh_cpp'
_LOCALHOST = '127.0.0.1'
# What else says where to look for others: a shell may have set them for another system.
_OTHERS = (PEERS, RANGE, SERVER, 'ROS_LOCALHOST_ONLY', 'ROS_SUPER_CLIENT')


def ros_variables(spec: SystemSpec) -> dict[str, str]:
    """Return the environment of a system, or of a part of it: that of its file comes first.

    A whole system runs on one computer, and needs no more than its ROS domain.
    """
    network = spec.network
    if network is None:
        return dict(spec.environment)
    found = {} if network.domain_id is None else {'ROS_DOMAIN_ID': str(network.domain_id)}
    if spec.host:
        found |= _VARIABLES[network.discovery](spec, network)
    return {**found, **spec.environment}


def find_sought(spec: SystemSpec) -> dict[str, str]:
    """Return the addresses at which the part of a host looks for other hosts, by their names."""
    network = spec.network
    if network is None or not spec.host or network.discovery == 'multicast':
        return {}
    others = {host.name: host.address for host in spec.hosts.values() if host.name != spec.host}
    if network.discovery == 'peers':
        return others
    return {name: address for name, address in others.items() if name == network.server}


def clear_others(variables: Mapping[str, str], shell: Mapping[str, str]) -> dict[str, str]:
    """Return the variables, with empty ones for what the shell says of discovery besides.

    Empty ones count as not set.

    Args:
        variables: Those of the part of a host.
    """
    return {**{name: '' for name in _OTHERS if name in shell}, **variables}


def drop_unknown_peers(variables: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Return the variables with those peers whose names are known, and the other names.

    ROS does not start with a peer whose name is not known, as that of a host which is off. Such a
    host looks for this one itself when it is back.
    """
    given = [each for each in variables.get(PEERS, '').split(';') if each]
    unknown = [each for each in given if not _is_known(each)]
    if not unknown:
        return dict(variables), []
    return {**variables, PEERS: ';'.join(each for each in given if each not in unknown)}, unknown


def _is_known(name: str) -> bool:
    try:
        socket.getaddrinfo(name, None, socket.AF_INET)
    except (OSError, UnicodeError):
        return False
    return True


def _multicast(_spec: SystemSpec, network: NetworkSpec) -> dict[str, str]:
    # With peers, Fast DDS announces itself to these alone, but still hears what is multicast.
    return {RANGE: 'SUBNET', **_peers_variable(network.peers)}


def _peers(spec: SystemSpec, network: NetworkSpec) -> dict[str, str]:
    # The range is that of discovery without peers: on this host.
    others = find_sought(spec).values()
    return {RANGE: 'LOCALHOST', **_peers_variable([*others, *network.peers])}


def _peers_variable(addresses: tuple[str, ...] | list[str]) -> dict[str, str]:
    given = dict.fromkeys(filter(None, addresses))
    return {PEERS: ';'.join(given)} if given else {}


def _discovery_server(spec: SystemSpec, network: NetworkSpec) -> dict[str, str]:
    # A client is told of the topics only that it has itself. One that is to wait for others, or
    # to list them, must be told of all.
    return {SERVER: f'{_server_address(spec, network)}:{network.port}', 'ROS_SUPER_CLIENT': 'TRUE'}


def _server_address(spec: SystemSpec, network: NetworkSpec) -> str:
    """Return where the part of a host finds the server: on its own host, also without a cable."""
    if network.server == spec.host:
        return _LOCALHOST
    host = spec.hosts.get(network.server)
    return (host.address if host else '') or network.server


def _zenoh(_spec: SystemSpec, network: NetworkSpec) -> dict[str, str]:
    # Each host has a router, to which the processes of the host connect by themselves.
    found = {'RMW_IMPLEMENTATION': ZENOH}
    if network.port != DEFAULT_ROUTER_PORT:
        found['ZENOH_CONFIG_OVERRIDE'] = f'connect/endpoints=["tcp/localhost:{network.port}"]'
    return found


def router_variables(spec: SystemSpec) -> dict[str, str]:
    """Return the environment of the Zenoh router of a host: all connect to that of the server."""
    network = spec.network
    if network is None:
        return {}
    settings = [f'listen/endpoints=["tcp/[::]:{network.port}"]']
    if network.server and network.server != spec.host:
        address = _server_address(spec, network)
        settings.append(f'connect/endpoints=["tcp/{address}:{network.port}"]')
    return {'ZENOH_CONFIG_OVERRIDE': ';'.join(settings)}


_VARIABLES: Mapping[Discovery, Callable[[SystemSpec, NetworkSpec], dict[str, str]]] = {
    'multicast': _multicast,
    'peers': _peers,
    'discovery_server': _discovery_server,
    'zenoh': _zenoh,
}
