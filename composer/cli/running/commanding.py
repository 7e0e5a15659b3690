"""`composer reload`, `restart` and `down`: tell a running system what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.cli.running.client import Client
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
        system = client.find(name)
        return _tell(system, client.ask(system, command, timeout_sec))


def restart(node: str, timeout_sec: float) -> int:
    """Build a node of a system anew; return the exit code."""
    with Client() as client:
        system, full_name = _find_node(client.find_all(), node)
        return _tell(system, client.restart(system, full_name, timeout_sec))


def down(name: str | None, timeout_sec: float) -> int:
    """Stop a system, and wait until it has; return the exit code."""
    with Client() as client:
        system = client.find(name)
        if not client.stop(system, timeout_sec):
            message = f"system '{system.name}' has not stopped within {timeout_sec:g} s"
            raise ComposerError(message, help='--timeout waits longer')
    click.echo(f'{escape(system.name)}: stopped')
    return ExitCode.DONE


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
        (system, node) for system in systems for node in (system.status or {}).get('nodes', ())
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
