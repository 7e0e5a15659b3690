"""`--host`: the part of a system that one host runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from composer.errors import UsageError
from composer.network.servers import with_servers
from composer.spelling import suggest

if TYPE_CHECKING:
    from composer.checks.context import CheckContext
    from composer.language.specs import NodeSpec, ProcessSpec


def take_part(context: CheckContext, host: str) -> CheckContext:
    """Return the context of what runs on a host, the servers of its network included."""
    part = context.on_host(host)
    return replace(part, spec=with_servers(part.spec))


def find_part(context: CheckContext, host: str) -> CheckContext:
    """Return the context of the part of a system that a host runs.

    Raises:
        UsageError: Nothing of it runs there.
    """
    part = take_part(context, host)
    spec = context.spec
    is_server = spec.network is not None and spec.network.server == host
    own = part.spec if is_server else spec.on_host(host)
    if own.nodes or own.processes:
        return part
    entries: list[NodeSpec | ProcessSpec] = [*spec.nodes.values(), *spec.processes.values()]
    used = sorted({each.host for each in entries} - {''})
    if host in spec.hosts:
        message = f"--host {host}: no node or process of '{spec.name}' runs there"
    else:
        message = f"--host {host}: '{spec.name}' has no such host"
    otherwise = "say which with 'host:' on nodes, processes, workers or includes"
    raise UsageError(message, help=suggest(host, used, 'there are', otherwise))
