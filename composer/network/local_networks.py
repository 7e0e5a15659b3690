"""Whether this computer is on a network, and has the port free that a server here needs.

Fast DDS looks for interfaces when a process starts, and uses no others later: a part of a system
that starts while its cable is out would never find the other hosts. So it waits a while.
"""

from __future__ import annotations

import errno
import fcntl
import socket
import struct
from time import monotonic, sleep
from typing import TYPE_CHECKING

from composer.errors import StartError
from composer.network.transport_profile import is_default_transport

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import SystemSpec

# `SIOCGIFFLAGS` and flags of `netdevice(7)`.
_GET_FLAGS = 0x8913
_LOOPBACK, _RUNNING = 0x8, 0x40
_REQUEST = struct.Struct('16sH14x')
_LONGEST_SEC = 40.0
_PORT_SEC = 5.0
_POLL_SEC = 0.25


def wait_for_network(spec: SystemSpec, tell: Callable[[str], object]) -> None:
    """Wait until the part of a host can reach the others, as far as this computer knows.

    Args:
        tell: Takes what is waited for, and that it did not come.
    """
    if not spec.host or len(spec.hosts) < 2 or is_on_network():  # noqa: PLR2004 - it and another
        return
    tell(f'network: no interface is up; the start waits for one, {_LONGEST_SEC:g} s at most')
    deadline = monotonic() + _LONGEST_SEC
    while not is_on_network():
        if monotonic() > deadline:
            tell(
                'network: the system starts without one, and finds no other host '
                'until it is started again'
            )
            return
        sleep(_POLL_SEC)


def check_loopback(spec: SystemSpec, variables: Mapping[str, str]) -> None:
    """Check that workers can find each other, for which Fast DDS needs the loopback interface.

    Args:
        variables: Those that the system starts with.

    Raises:
        StartError: It is down.
    """
    has_workers = any(node.worker for node in spec.nodes.values())
    if has_workers and is_default_transport(variables) and not _has_interface(_LOOPBACK):
        message = 'workers cannot find each other: the loopback interface is down'
        raise StartError(message, help="run 'ip link set lo up'")


def wait_for_port(spec: SystemSpec) -> None:
    """Wait until the port of the discovery server is free, if the part of a host runs that.

    The server of a system that was killed may be there for a moment.

    Raises:
        StartError: Another program has it.
    """
    network = spec.network
    if network is None or network.discovery != 'discovery_server' or network.server != spec.host:
        return
    deadline = monotonic() + _PORT_SEC
    while not _is_free(network.port):
        if monotonic() > deadline:
            message = (
                f'the discovery server cannot run: UDP port {network.port} of this host is in use'
            )
            advice = (
                f"'ss -lunp sport = :{network.port}' tells by what; 'port:' is for another one"
            )
            raise StartError(message, help=advice)
        sleep(_POLL_SEC)


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp_socket:
        try:
            udp_socket.bind(('', port))
        except OSError as error:
            # Any other error is for the server to tell.
            return error.errno != errno.EADDRINUSE
    return True


def is_on_network() -> bool:
    """Return whether an interface runs, beside that to this computer itself."""
    return _has_interface(0)


def _has_interface(kind: int) -> bool:
    """Return whether an interface runs, of those of the loopback or of all others."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        return any(_runs(any_socket, name, kind) for _, name in socket.if_nameindex())


def _runs(any_socket: socket.socket, name: str, kind: int) -> bool:
    request = _REQUEST.pack(name.encode(), 0)
    try:
        _, flags = _REQUEST.unpack(fcntl.ioctl(any_socket, _GET_FLAGS, request))
    except OSError:
        return False  # It has just gone.
    return bool(flags & _RUNNING) and flags & _LOOPBACK == kind
