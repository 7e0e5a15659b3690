"""Declare the commands that ask running systems: see `composer.cli.commands`."""

from __future__ import annotations

from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.cli.common.argument_types import takes_format, takes_settings
from composer.cli.running.asked_system import AskedSystem
from composer.cli.running.top_table import DEFAULT_SORT, SORT_NAMES, View

if TYPE_CHECKING:
    from collections.abc import Callable

_LONGEST_SEC = 60.0
_ANSWER_SEC = 5.0

_timeout = click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_LONGEST_SEC,
    show_default=True,
    metavar='SEC',
    help='How long to wait for the end of it.',
)


def _takes_asked(command: Callable[..., int]) -> Callable[..., int]:
    """Add the name of a system to a command, or its files with what they are read with."""

    @click.argument('words', nargs=-1, metavar='[SYSTEM | FILE [LAYER]... [NAME:=VALUE]...]')
    @takes_settings
    @click.option(
        '--host',
        'hosts',
        multiple=True,
        metavar='NAME',
        help='Of a FILE, only this host. Can be repeated.',
    )
    @wraps(command)
    def run(
        *,
        words: tuple[str, ...],
        set_values: tuple[str, ...],
        hosts: tuple[str, ...],
        **options: object,
    ) -> int:
        return command(AskedSystem(words, set_values, hosts), **options)

    return run


@click.command('ps')
@_takes_asked
@takes_format()
def ps_command(asked: AskedSystem, format_name: str) -> int:
    """List the systems that run on this ROS graph, or SYSTEM alone.

    Of a FILE that declares hosts, its parts are listed: each host is asked over SSH.
    If there is no such system, or it or one of its parts does not answer, the exit code is 1.
    """
    if asked.are_files:
        from composer.cli.hosts.across import ps_across

        return ps_across(asked, format_name=format_name)
    from composer.cli.running.ps import list_running

    return list_running(asked.name, format_name=format_name)


@click.command('top')
@_takes_asked
@click.option('--once', is_flag=True, help='Print the table once.')
@takes_format()
@click.option(
    '--sort',
    type=click.Choice(list(SORT_NAMES)),
    default=DEFAULT_SORT,
    show_default=True,
    help='The column to sort by.',
)
@click.option('--filter', 'text', default='', metavar='TEXT', help='Only rows with this text.')
@click.option(
    '--by',
    type=click.Choice(['entity', 'node']),
    default='entity',
    show_default=True,
    help='What a row is.',
)
# For a screen that shows several hosts.
@click.option('--each-period', is_flag=True, hidden=True)
def top_command(
    asked: AskedSystem,
    format_name: str,
    sort: str,
    text: str,
    by: str,
    *,
    once: bool,
    each_period: bool,
) -> int:
    """Show the health of each entity, or of each node, of SYSTEM.

    Calls in a second, callback times, the share of a processor, messages that wait in the queue;
    and since the start dropped messages, late ticks and errors. SYSTEM is its name; if only one
    runs, it need not be named; of a FILE that declares hosts, all of these are asked.
    Where the output is no terminal that can draw, and as JSON, it is printed once.
    """
    view = View(sort=sort, text=text, by=by)
    if asked.are_files:
        from composer.cli.hosts.across import top_across

        return top_across(asked, view, once=once, format_name=format_name)
    from composer.cli.running.top import top

    return top(asked.name, view, once=once, format_name=format_name, each_period=each_period)


@click.command('reload')
@_takes_asked
@_timeout
@click.option(
    '--now',
    'aborts_goals',
    is_flag=True,
    help='Abort goals in flight of actions that go, which it waits for otherwise.',
)
def reload_command(asked: AskedSystem, timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let SYSTEM read its files again, and become what they say.

    SYSTEM is its name, that of its file without the ending; if only one runs, it need not be
    named; of a FILE that declares hosts, all of these are told. If the files have errors, it runs
    on as it was.
    """
    if asked.are_files:
        from composer.cli.hosts.across import reload_across

        return reload_across(asked, timeout_sec, aborts_goals=aborts_goals)
    from composer.cli.running.commanding import reload

    return reload(asked.name, timeout_sec, aborts_goals=aborts_goals)


@click.command('restart')
@click.argument('node')
@_timeout
def restart_command(node: str, timeout_sec: float) -> int:
    """Build a node, or start an external process, anew.

    Its entities, parameters and state are as at the start again. NODE is its full name, or what
    follows the last slash of it; or the name of an external process.
    """
    from composer.cli.running.commanding import restart

    return restart(node, timeout_sec)


@click.command('down')
@_takes_asked
@_timeout
def down_command(asked: AskedSystem, timeout_sec: float) -> int:
    """Stop SYSTEM, and wait until it has stopped.

    SYSTEM is its name; if only one runs, it need not be named. A FILE that declares hosts is
    stopped on all of them, until they boot or are deployed to.
    """
    if asked.are_files:
        from composer.cli.hosts.across import down_across

        return down_across(asked, timeout_sec)
    from composer.cli.running.commanding import down

    return down(asked.name, timeout_sec)


@click.command('logs')
@_takes_asked
@click.option('--follow', '-f', 'follows', is_flag=True, help='Go on until the system ends.')
def logs_command(asked: AskedSystem, *, follows: bool) -> int:
    """Print what SYSTEM on this host has said.

    It must write to a file, as 'composer up --detach' does. Of one that has ended, the last log is
    printed. Of a FILE that declares hosts, their logs are printed, each line with its host.
    """
    if asked.are_files:
        from composer.cli.hosts.across import logs_across

        return logs_across(asked, follows=follows)
    from composer.cli.running.log_files import show_logs

    return show_logs(asked.name, follows=follows)


@click.command('capture')
@click.argument('nodes', nargs=-1, metavar='[NODE]...')
@click.option(
    '-o',
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='The file to write. Default: standard output.',
)
@click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_ANSWER_SEC,
    show_default=True,
    metavar='SEC',
    help='How long nodes may take to say which parameters they have.',
)
def capture_command(nodes: tuple[str, ...], output: Path | None, timeout_sec: float) -> int:
    """Write down what the nodes on this ROS graph have.

    Each NODE, or all nodes, with publishers, subscriptions, services, clients and actions, their
    types and QoS, and with parameters: to paste under `processes:`, so that `composer check`
    knows what they have. NODE is a full name, or what follows the last slash of it. If a node
    does not say its parameters, the exit code is 1.
    """
    from composer.cli.running.capture import capture

    return capture(nodes, output=output, timeout_sec=timeout_sec)


COMMANDS = (
    capture_command,
    ps_command,
    top_command,
    logs_command,
    reload_command,
    restart_command,
    down_command,
)
