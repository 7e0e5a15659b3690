"""`composer top`: the health of each entity of a running system, as a table that changes."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import click

from composer.application.running_systems.client import Client
from composer.application.running_systems.discovery import Discovery
from composer.application.running_systems.health import (
    Poller,
    wait_for_health,
)
from composer.cli.running.top_table import (
    describe_worst,
    find_worst,
    list_processes,
    render_entities,
    select_entities,
)
from composer.errors import ExitCode
from composer.runtime.control import protocol

if TYPE_CHECKING:
    from composer.cli.running.top_table import View


def top(name: str | None, view: View, *, once: bool, format_name: str) -> int:
    """Show the health of each entity; return the exit code.

    Args:
        name: Of the system; `None` for the only one.
        view: What to show first.
        once: Whether to print it once. So it is where there is no screen.
        format_name: `text` or `json`; JSON is printed once.

    Raises:
        ComposerError: There is no such system, it measures nothing, or it ended.
    """
    if not (once or format_name == 'json') and has_screen():
        return _watch(name, view)
    with Client() as client:
        system = Discovery(client).find(name)
        with client.asking(system, protocol.TOP) as ask:
            document = wait_for_health(ask)
            print_health(document, view, format_name)
            return ExitCode.DONE


def has_screen() -> bool:
    """Return whether there is a terminal that can draw."""
    from composer.cli.running.top_screen import can_draw

    return sys.stdout.isatty() and sys.stdin.isatty() and can_draw()


def print_health(document: dict[str, Any], view: View, format_name: str) -> None:
    """Print what a system says of its entities."""
    entities = select_entities(document['entities'], view)
    if format_name == 'json':
        others = {key: value for key, value in document.items() if key != 'entities'}
        rows = {'nodes' if view.by == 'node' else 'entities': entities}
        found = {'kept_waiting_by': find_worst(document), **rows}
        click.echo(json.dumps({**others, **found}, indent=2))
    else:
        lines = map(describe_worst, find_worst(document))
        processes = list_processes(document)
        click.echo('\n'.join([*render_entities(entities), *lines, *processes]))


def _watch(name: str | None, view: View) -> int:
    from composer.cli.running.top_screen import show_screen

    poller = Poller(name)
    poller.start()
    try:
        show_screen(poller, view)
    finally:
        error = poller.error
        poller.stop()
    if error is not None:
        raise error
    return ExitCode.DONE
