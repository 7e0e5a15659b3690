"""Commands to running systems: reload; restart, stop or start a node; stop."""

from __future__ import annotations

import os
import select
from contextlib import suppress
from typing import TYPE_CHECKING

from composer.application.running_systems.client import (
    STATUS_SEC,
    Client,
    EndedError,
    wait_until,
)
from composer.application.running_systems.discovery import Discovery
from composer.errors import ComposerError, UsageError
from composer.runtime.control import protocol
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.application.running_systems.client import RunningSystem
    from composer.runtime.health.system_state import Outcome


def reload(
    name: str | None = None, timeout_sec: float = 60.0, *, aborts_goals: bool = False
) -> tuple[str, Outcome]:
    """Let a system read its files again; return its name, and what came of it.

    Args:
        name: Of the system; `None` for the only one.
        timeout_sec: How long it may take to answer.
        aborts_goals: Whether goals of actions that go are aborted; else they are waited for.

    Raises:
        ComposerError: There is no such system, or it does not answer.
        UsageError: There are several systems.
    """
    command = protocol.RELOAD_NOW if aborts_goals else protocol.RELOAD
    with Client() as client:
        system = Discovery(client).find(name)
        return system.name, client.ask(system, command, timeout_sec)


def restart(
    node: str, timeout_sec: float = 60.0, *, action: str = 'restart'
) -> tuple[str, Outcome]:
    """Let a system build a node or start an external process anew.

    Args:
        node: The full name, or what follows the last slash of it if that tells it; or the name
            of an external process.
        timeout_sec: How long the system may take to answer.
        action: Or `stop` a node, or `start` one that was stopped.

    Returns:
        The system's name, and what came of it.

    Raises:
        ComposerError: No system has such a node, or it does not answer.
        UsageError: There are several nodes of this name.
    """
    with Client() as client:
        system, full_name = _find_node(Discovery(client).find_all(), node)
        return system.name, client.restart(system, full_name, timeout_sec, action)


def down(name: str | None = None, timeout_sec: float = 60.0) -> str:
    """Stop a system, and wait until it has stopped; return its name.

    Raises:
        ComposerError: There is no such system, or it has not stopped in time.
        UsageError: There are several systems.
    """
    with Client() as client:
        discovery = Discovery(client)
        system = discovery.find(name)
        if not _stop(client, discovery, system, timeout_sec):
            message = f"system '{system.name}' has not stopped within {timeout_sec:g} s"
            raise ComposerError(message, help='--timeout waits longer')
    return system.name


def _stop(client: Client, discovery: Discovery, system: RunningSystem, timeout_sec: float) -> bool:
    """Stop a system, and wait until it has left the graph; return whether it has.

    One on this host has left with its process, of which the graph may hear late.
    """
    pid = discovery.find_process(system)
    process = None if pid is None else _open_process(pid)
    try:
        with suppress(EndedError):
            client.ask(system, protocol.DOWN, STATUS_SEC)
        if process is None:
            return wait_until(lambda: not discovery.is_there(system), timeout_sec)
        return bool(select.select([process], [], [], timeout_sec)[0])
    finally:
        if process is not None:
            os.close(process)


def _open_process(pid: int) -> int | None:
    try:
        return os.pidfd_open(pid)
    except ProcessLookupError:
        return None


def _find_node(systems: Sequence[RunningSystem], name: str) -> tuple[RunningSystem, str]:
    """Return the system that has a node or a process, and the full name of that.

    Args:
        name: See `restart`.
    """
    nodes = [
        (system, node)
        for system in systems
        for key in ('nodes', 'components', 'stopped')
        for node in (system.status or {}).get(key, ())
    ]
    nodes += [
        (system, process['name'])
        for system in systems
        for process in (system.status or {}).get('external_processes', ())
    ]
    found = [each for each in nodes if each[1] == name]
    found = found or [each for each in nodes if each[1] == f'/{name}']
    found = found or [each for each in nodes if each[1].endswith(f'/{name}')]
    if len(found) == 1:
        return found[0]
    if found:
        message = f"several nodes or processes are called '{name}'"
        listed = ', '.join(f'{node} (of {system.name})' for system, node in found)
        raise UsageError(message, help=f'give its full name: {listed}')
    silent = [system.name for system in systems if system.problem == 'no answer']
    if silent:
        what = f"a node or process '{name}'"
        message = f"no system that answers has {what}, and '{silent[0]}' does not answer"
        raise ComposerError(message, help='try again')
    names = {node for _, node in nodes} | {node.rpartition('/')[2] for _, node in nodes}
    advice = suggest(name, names, 'there are', 'no system runs')
    message = f"no system on this ROS graph has a node or process '{name}'"
    raise ComposerError(message, help=advice)
