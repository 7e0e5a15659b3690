"""`composer ps`: list the systems that run on this ROS graph."""

from __future__ import annotations

import json
import time
from socket import gethostname
from typing import TYPE_CHECKING

import click

from composer.application.running_systems.client import Client
from composer.application.running_systems.discovery import Discovery
from composer.cli.running.tables import format_duration, render_processes, render_table
from composer.errors import ExitCode
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.application.running_systems.client import RunningSystem

_HEADER = ('NAME', 'STATE', 'HEALTH', 'NODES', 'UPTIME', 'LAST RELOAD', 'HOST', 'PID', 'FILE')
_LONGEST_NOTE = 200


def list_running(name: str | None, *, format_name: str) -> int:
    """Print the systems that run; return the exit code.

    Args:
        name: The only one to print; `None` for all.

    Raises:
        ComposerError: No system of that name runs.
    """
    with Client() as client:
        discovery = Discovery(client)
        systems = discovery.find_all() if name is None else [discovery.find(name)]
        silent = discovery.find_silent(systems) if name is None else []
    code = ExitCode.DONE if name is None or systems[0].status else ExitCode.FAILED
    # Those are stopped, say, and so no longer on the graph.
    unnamed = [
        {'name': '?', 'state': 'no answer', 'host': gethostname(), 'pid': each} for each in silent
    ]
    if not systems and not unnamed and format_name != 'json':
        click.echo('no system runs on this ROS graph', err=True)
        return ExitCode.DONE
    print_systems(systems, unnamed, format_name=format_name)
    return code


def print_systems(
    systems: Sequence[RunningSystem],
    unnamed: Sequence[Mapping[str, object]] = (),
    *,
    format_name: str,
) -> None:
    """Print systems, and processes that run systems whose names are not known."""
    if format_name == 'json':
        documents = [*map(_document, systems), *unnamed]
        click.echo(json.dumps({'version': 1, 'systems': documents}, indent=2))
        return
    notes = [note for each in systems for note in _notes(each)]
    rows = [
        *map(_row, systems),
        *([str(each.get(key.lower(), '')) for key in _HEADER] for each in unnamed),
    ]
    processes = render_processes(
        (each.name, process)
        for each in systems
        for process in (each.status or {}).get('external_processes', ())
    )
    click.echo('\n'.join([*render_table(_HEADER, rows), *notes, *processes]))


def _document(system: RunningSystem) -> dict[str, object]:
    if system.status is None:
        return {'name': system.name, 'state': system.problem}
    return {key: value for key, value in system.status.items() if key != 'version'}


def _row(system: RunningSystem) -> tuple[str, ...]:
    status = system.status
    if status is None:
        return (system.name, system.problem, *[''] * (len(_HEADER) - 2))
    health, last = status['health'], status['last_reload']
    reload = ''
    if last is not None:
        ago = format_duration(max(0.0, time.time() - last['time']))
        reload = f'{ago} ago' if last['succeeded'] else f'failed {ago} ago'
    return (
        system.name,
        status['state'],
        '-' if health is None else health['level'],
        str(len(status['nodes'])),
        format_duration(status['uptime_sec']),
        reload,
        status['host'],
        str(status['pid']),
        status['file'],
    )


def _notes(system: RunningSystem) -> list[str]:
    """Return what is wrong with a system, in lines below the table."""
    status = system.status
    if status is None:
        return []
    told = {
        'health': (status['health'] or {}).get('message', ''),
        'last reload': status['last_error'],
        'stopped': ', '.join(status['stopped']),
        'not active': ', '.join(
            f'{node} is {state}'
            for node, state in status['lifecycles'].items()
            if state != 'active'
        ),
        'not started': ', '.join(
            f'{who} waits for {what}' for who, what in status['awaited'].items()
        ),
    }
    texts = {key: escape(' '.join(text.split())) for key, text in told.items() if text}
    return [f'{escape(system.name)}: {key}: {text[:_LONGEST_NOTE]}' for key, text in texts.items()]
