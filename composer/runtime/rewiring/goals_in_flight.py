"""Goals of actions that go are waited for, or aborted, before a system changes."""

from __future__ import annotations

from time import sleep
from typing import TYPE_CHECKING, Any

from composer.errors import StartError
from composer.planning.plan import GOING
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from composer.planning.plan import Plan
    from composer.runtime.entities.actions import ActionServer
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.stop_request import StopRequest

_POLL_SEC = 0.02


def find_going_actions(nodes: Mapping[str, LiveNode], plan: Plan) -> Iterator[ActionServer]:
    """Yield the actions that go, alone or with their nodes."""
    for operation in plan.operations:
        full_name, section, name = operation.target
        node = nodes.get(full_name)
        if node is None or operation.action not in GOING or section not in ('nodes', 'actions'):
            continue
        actions: dict[str, Any] = node.entities['actions']
        yield from actions.values() if section == 'nodes' else [actions[name]]


def wait_for_goals(
    servers: Collection[ActionServer],
    stop: StopRequest,
    aborts: Callable[[], bool],
    is_outdated: Callable[[], bool],
) -> None:
    """Let actions accept no more goals, and wait until none is in flight, or for a stop.

    Args:
        aborts: Returns whether the goals are aborted; asked again and again.
        is_outdated: Returns whether there is a newer edit; asked again and again.

    Raises:
        StartError: There is; the actions accept goals again.
    """
    for server in servers:
        server.retire(is_retired=True)
    was_told = False
    while any(each.has_goals for each in servers) and not stop.is_set:
        if is_outdated():
            for server in servers:
                server.retire(is_retired=False)
            message = 'the files have changed while goals were waited for'
            raise StartError(message)
        if aborts():
            for server in servers:
                server.retire(is_retired=True, aborts=True)
        elif not was_told:
            was_told = True
            system_logger.info('reload: waiting for the goals in flight of actions that go…')
        sleep(_POLL_SEC)
