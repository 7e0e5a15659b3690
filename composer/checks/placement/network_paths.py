"""Whether the processes of different hosts can find each other, as `network:` says."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.ament import has_ros
from composer.checks.environment import installed_middlewares
from composer.checks.placement.crossings import list_crossings, place_of
from composer.network.addresses import is_loopback
from composer.network.servers import SERVED, list_sought
from composer.network.variables import RANGE, ZENOH

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import Discovery, NetworkSpec

_DOMAIN = 'ROS_DOMAIN_ID'
_LOCALHOST_ONLY = 'ROS_LOCALHOST_ONLY'
_MIDDLEWARE = 'RMW_IMPLEMENTATION'
_FAST_DDS = ('rmw_fastrtps_cpp', 'rmw_fastrtps_dynamic_cpp')
# Their ports are those of `net.ipv4.ip_local_port_range`
# (https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html).
_FIRST_EPHEMERAL, _LAST_EPHEMERAL = 102, 214
# What the environment of the file may say so that no host finds another one.
_CLOSED: Mapping[Discovery, Mapping[str, tuple[str, ...]]] = {
    'multicast': {RANGE: ('LOCALHOST', 'OFF'), _LOCALHOST_ONLY: ('1',)},
    'peers': {RANGE: ('OFF',), _LOCALHOST_ONLY: ('1',)},
    'discovery_server': {RANGE: ('OFF',)},
    'zenoh': {},
}


def check_network(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that what crosses between hosts has a path."""
    network = context.spec.network
    if network is not None:
        yield from _check_domain(context, network)
        yield from _check_middleware(context, network)
    crossing = _find_crossing(context)
    if crossing is None:
        return
    what, hosts = crossing
    yield from _check_environment(context, network, what)
    if network is None:
        return
    if network.discovery in SERVED and not network.server:
        yield context.at_value(
            context.inner(network.path, 'discovery'),
            'no-network-path',
            f"no host is named for the server of '{network.discovery}', and {what}",
            help=f"write 'server: HOST', as in 'server: {hosts[0]}'",
        )
    for host in list_sought(context.spec, hosts):
        if is_loopback(host.address):
            yield context.at_value(
                (*host.path, 'address'),
                'no-network-path',
                f"'{host.address}' is another computer on each host, and {what}",
                help='give the address that the other hosts have for it',
            )


def _find_crossing(context: CheckContext) -> tuple[str, list[str]] | None:
    """Return what crosses between hosts first, in words, and the hosts of all that does."""
    first = ''
    found: dict[str, None] = {}
    for crossing in list_crossings(context):
        ends = (*crossing.senders, *crossing.receivers)
        hosts = dict.fromkeys(host for host, _ in map(place_of, ends) if host)
        if len(hosts) > 1:
            one, other, *_ = hosts
            channel = crossing.channel
            first = first or f"{channel.kind} '{channel.name}' crosses between {one} and {other}"
            found |= hosts
    return (first, list(found)) if first else None


def _check_environment(
    context: CheckContext, network: NetworkSpec | None, what: str
) -> Iterator[Diagnostic]:
    discovery: Discovery = network.discovery if network else 'multicast'
    for name, values in _CLOSED[discovery].items():
        value = context.spec.environment.get(name)
        if value in values:
            yield context.at_value(
                ('environment', name),
                'no-network-path',
                f'with {name}={value} no host finds another one by {discovery}, and {what}',
                help='leave it out',
            )


def _check_domain(context: CheckContext, network: NetworkSpec) -> Iterator[Diagnostic]:
    domain = network.domain_id
    path = (*network.path, 'domain_id')
    if domain is None or path not in context.system.positions.values:
        return
    written = context.spec.environment.get(_DOMAIN)
    if written and written != str(domain):
        yield context.at_value(
            path,
            'conflicting-domains',
            f'the domain is {domain} here, and {_DOMAIN} is {written} under environment',
            help='say it once',
            related=[context.related(('environment', _DOMAIN), 'the other domain is here')],
        )
    if _FIRST_EPHEMERAL <= domain <= _LAST_EPHEMERAL:
        yield context.at_value(
            path,
            'ephemeral-ports',
            f'Linux gives the ports of domain {domain} to any program that connects somewhere',
            help='take one from 0 to 101',
        )


def _check_middleware(context: CheckContext, network: NetworkSpec) -> Iterator[Diagnostic]:
    path = context.inner(network.path, 'discovery')
    written = context.spec.environment.get(_MIDDLEWARE)
    wanted = {'zenoh': (ZENOH,), 'discovery_server': _FAST_DDS}.get(network.discovery)
    if wanted and written and written not in wanted:
        yield context.at_value(
            path,
            'no-network-path',
            f"'{network.discovery}' is of {wanted[0]}, and {_MIDDLEWARE} is {written}",
            help='leave one of them out',
            related=[context.related(('environment', _MIDDLEWARE), 'it is named here')],
        )
    elif network.discovery == 'zenoh' and has_ros() and ZENOH not in installed_middlewares():
        yield context.at_value(
            path,
            'missing-middleware',
            f"'zenoh' is of {ZENOH}, which is not installed here",
            help=f'install it on all hosts: apt install ros-$ROS_DISTRO-{ZENOH.replace("_", "-")}',
        )
