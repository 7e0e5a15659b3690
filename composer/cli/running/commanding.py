"""`composer reload`, `restart` and `down`: tell a running system what to do."""

from __future__ import annotations

import os
import select
from typing import TYPE_CHECKING

import click

from composer.cli.running.client import STATUS_SEC, Client, wait_until
from composer.cli.running.discovery import Discovery
from composer.errors import ComposerError, ExitCode, UsageError
from composer.runtime.control import protocol
from composer.spelling import suggest
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.cli.running.client import RunningSystem
    from composer.runtime.health.system_state import Outcome


def reload(name: str | None, timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let a system read its files again; return the exit code."""
    command = protocol.RELOAD_NOW if aborts_goals else protocol.RELOAD
    with Client() as client:
        system = Discovery(client).find(name)
        return _tell(system, client.ask(system, command, timeout_sec))


def restart(node: str, timeout_sec: float) -> int:
    """Build a node of a system anew; return the exit code."""
    with Client() as client:
        system, full_name = _find_node(Discovery(client).find_all(), node)
        return _tell(system, client.restart(system, full_name, timeout_sec))


def down(name: str | None, timeout_sec: float) -> int:
    """Stop a system, and wait until it has; return the exit code."""
    with Client() as client:
        discovery = Discovery(client)
        system = discovery.find(name)
        if not _stop(client, discovery, system, timeout_sec):
            message = f"system '{system.name}' has not stopped within {timeout_sec:g} s"
            raise ComposerError(message, help='--timeout waits longer')
    click.echo(f'{escape(system.name)}: stopped')
    return ExitCode.DONE


def _stop(client: Client, discovery: Discovery, system: RunningSystem, timeout_sec: float) -> bool:
    """Stop a system, and wait until it has left the graph; return whether it has.

    One on this host has left with its process, of which the graph may hear late.
    """
    pid = discovery.find_process(system)
    process = None if pid is None else _open_process(pid)
    try:
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


def _tell(system: RunningSystem, outcome: Outcome) -> int:
    """Print what came of a command: the last line is the result, and before it are findings."""
    *findings, result = (escape(line) for line in outcome.text.split('\n'))
    if findings:
        click.echo('\n'.join(findings), err=True)
    click.echo(f'{escape(system.name)}: {result}', err=not outcome.succeeded)
    return ExitCode.DONE if outcome.succeeded else ExitCode.FAILED


def _find_node(systems: Iterable[RunningSystem], name: str) -> tuple[RunningSystem, str]:
    """Return the system that has a node, and the node's full name.

    Args:
        name: Its full name, or what follows the last slash of it if that tells it.
    """
    nodes = [
        (system, node)
        for system in systems
        for key in ('nodes', 'components')
        for node in (system.status or {}).get(key, ())
    ]
    found = [each for each in nodes if each[1] == f'/{name.lstrip("/")}']
    found = found or [each for each in nodes if each[1].endswith(f'/{name}')]
    if len(found) == 1:
        return found[0]
    if found:
        message = f"several nodes are called '{name}'"
        listed = ', '.join(f'{node} (of {system.name})' for system, node in found)
        raise UsageError(message, help=f'give its full name: {listed}')
    names = {node for _, node in nodes} | {node.rpartition('/')[2] for _, node in nodes}
    advice = suggest(name, names, 'there are', 'no system runs')
    message = f"no system on this ROS graph has a node '{name}'"
    raise ComposerError(message, help=advice)
