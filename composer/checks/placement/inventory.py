"""Whether hosts can be reached as the inventory says it, and what of `network:` counts."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.network.addresses import is_address, normalise_address
from composer.network.servers import SERVED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import HostSpec, NetworkSpec

_ROOT = 'root'
# Also of a domain, as in name@example.org. Helps show it in lines for a shell.
_USER = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_.@-]{0,255}\$?', re.ASCII)
# What is written with an address elsewhere, and where it is written here.
_REPAIRS = (
    (re.compile(r'-.*'), 'programs would take it for an option'),
    (re.compile(r'[^@]+@.+'), "the user has a key of its own, 'user:'"),
    (re.compile(r'\[.+\](:\d+)?'), "write it without brackets; its port goes into 'port:'"),
    (re.compile(r'[^:]+:\d+'), "the port has a key of its own, 'port:'"),
    (re.compile(r'[^/]+/\d+'), 'leave out the slash and what comes after it'),
)


def check_inventory(context: CheckContext) -> Iterator[Diagnostic]:
    """Check each host for itself, and that no two are the same one."""
    seen: dict[tuple[object, ...], HostSpec] = {}
    for host in context.spec.hosts.values():
        yield from _check_address(context, host)
        yield from _check_user(context, host)
        place = (normalise_address(host.address), host.user, host.port, host.folder)
        other = seen.setdefault(place, host)
        if other is not host:
            yield context.at_key(
                host.path,
                'duplicate-host',
                f"'{host.name}' has the address, user and folder of '{other.name}'",
                help='give one of them another folder, or use one name for both',
                related=[context.related(other.path, 'the other host is here')],
            )


def check_network_keys(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that peers are addresses, and that all keys of the network count."""
    network = context.spec.network
    if network is None:
        return
    for index, peer in enumerate(network.peers):
        if not is_address(peer):
            yield context.at_value(
                (*network.path, 'peers', index),
                'bad-value',
                f"expected the IP address or name of a computer; got '{peer}'",
                help='a peer is an address alone, as 10.0.0.9',
            )
    yield from _check_kind(context, network)


def _check_address(context: CheckContext, host: HostSpec) -> Iterator[Diagnostic]:
    if not is_address(host.address):
        helps = (text for form, text in _REPAIRS if form.fullmatch(host.address))
        yield context.at_value(
            (*host.path, 'address'),
            'bad-value',
            f"expected the IP address or name of a computer; got '{host.address}'",
            help=next(helps, 'a name has letters, digits, dashes, underscores and dots'),
        )


def _check_user(context: CheckContext, host: HostSpec) -> Iterator[Diagnostic]:
    if host.user and not _USER.fullmatch(host.user):
        yield context.at_value(
            (*host.path, 'user'),
            'bad-value',
            f"expected the name of a user; got '{host.user}'",
            help='a name has letters, digits, dashes, underscores and dots',
        )
        return
    if host.systemd == 'system' and host.user != _ROOT:
        yield context.at_value(
            (*host.path, 'systemd'),
            'needs-root',
            f"units of the system are for root, and the user of '{host.name}' is "
            f'{host.user or "not named"}',
            help="write 'user: root', or 'systemd: user'",
        )


def _check_kind(context: CheckContext, network: NetworkSpec) -> Iterator[Diagnostic]:
    is_served = network.discovery in SERVED
    for key in ('peers',) if is_served else ('server', 'port'):
        path = (*network.path, key)
        if path in context.system.positions.values:
            yield context.at_key(
                path,
                'ignored-network-key',
                f"'{key}' counts for nothing with the discovery '{network.discovery}'",
                help=f'leave it out, or choose {_choices(key)}',
            )


def _choices(key: str) -> str:
    return "'multicast' or 'peers'" if key == 'peers' else "'discovery_server' or 'zenoh'"
