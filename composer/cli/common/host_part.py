"""`--host`: the part of a system that one host runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.errors import UsageError
from composer.spelling import suggest

if TYPE_CHECKING:
    from composer.checks.context import CheckContext
    from composer.language.specs import NodeSpec, ProcessSpec


def find_part(context: CheckContext, host: str) -> CheckContext:
    """Return the context of the part of a system that a host runs.

    Raises:
        UsageError: Nothing of it runs there.
    """
    part = context.on_host(host)
    if part.spec.nodes or part.spec.processes:
        return part
    spec = context.spec
    entries: list[NodeSpec | ProcessSpec] = [*spec.nodes.values(), *spec.processes.values()]
    used = sorted({each.host for each in entries} - {''})
    if host in spec.hosts:
        message = f"--host {host}: no node or process of '{spec.name}' runs there"
    else:
        message = f"--host {host}: '{spec.name}' has no such host"
    otherwise = "say which with 'host:' on nodes, processes, workers or includes"
    raise UsageError(message, help=suggest(host, used, 'there are', otherwise))
