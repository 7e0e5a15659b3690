"""`composer reload`, `restart`, `stop`, `start` and `down`: tell a running system what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application import ask
from composer.errors import ExitCode
from composer.terminal import escape

if TYPE_CHECKING:
    from composer.runtime.health.system_state import Outcome


def reload(name: str | None, timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let a system read its files again; return the exit code."""
    return _tell(*ask.reload(name, timeout_sec, aborts_goals=aborts_goals))


def restart(node: str, timeout_sec: float, action: str) -> int:
    """Restart, stop or start a node of a system; return the exit code."""
    return _tell(*ask.restart(node, timeout_sec, action=action))


def down(name: str | None, timeout_sec: float) -> int:
    """Stop a system, and wait until it has; return the exit code."""
    click.echo(f'{escape(ask.down(name, timeout_sec))}: stopped')
    return ExitCode.DONE


def _tell(name: str, outcome: Outcome) -> int:
    """Print what came of a command: the last line is the result, and before it are findings."""
    *findings, result = (escape(line) for line in outcome.text.split('\n'))
    if findings:
        click.echo('\n'.join(findings), err=True)
    click.echo(f'{escape(name)}: {result}', err=not outcome.succeeded)
    return ExitCode.DONE if outcome.succeeded else ExitCode.FAILED
