"""Declare the commands that ask running systems: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.cli.common.argument_types import NUMBERS_ARE_VALUES, split_words, takes_system
from composer.cli.running.top_table import DEFAULT_SORT, SORT_NAMES, View

if TYPE_CHECKING:
    from collections.abc import Sequence

_LONGEST_SEC = 60.0
_ANSWER_SEC = 5.0

_system = click.argument('words', nargs=-1, metavar='[SYSTEM | FILE [LAYER]...]')
_timeout = click.option(
    '--timeout',
    'timeout_sec',
    type=click.FloatRange(min=0, min_open=True),
    default=_LONGEST_SEC,
    show_default=True,
    metavar='SEC',
    help='How long to wait for the end of it.',
)
_format = click.option(
    '--format',
    'format_name',
    type=click.Choice(['text', 'json']),
    default='text',
    show_default=True,
    help='The output format.',
)


def _are_files(words: Sequence[str]) -> bool:
    """Return whether the words name a system by its files: its hosts are asked."""
    return bool(words) and words[0].endswith(('.yaml', '.yml'))


def _system_of(words: Sequence[str]) -> str | None:
    """Return the name of a system; `None` if none was given.

    Raises:
        click.UsageError: There is more than a name.
    """
    if len(words) > 1:
        message = f'Got unexpected extra argument ({words[1]})'
        raise click.UsageError(message, click.get_current_context())
    return words[0] if words else None


@click.command('ps')
@_system
@_format
def ps_command(words: tuple[str, ...], format_name: str) -> int:
    """List the systems that run on this ROS graph, or SYSTEM alone.

    Of a FILE that declares hosts, its parts are listed: each host is asked over SSH.
    If there is no such system, or it does not answer, the exit code is 1.
    """
    if _are_files(words):
        from composer.cli.hosts.across import ps_across

        return ps_across(words, format_name=format_name)
    from composer.cli.running.ps import list_running

    return list_running(_system_of(words), format_name=format_name)


@click.command('top')
@_system
@click.option('--once', is_flag=True, help='Print the table once.')
@_format
@click.option(
    '--sort',
    type=click.Choice(list(SORT_NAMES)),
    default=DEFAULT_SORT,
    show_default=True,
    help='The column to sort by.',
)
@click.option('--filter', 'text', default='', metavar='TEXT', help='Only entities with this text.')
def top_command(
    words: tuple[str, ...], format_name: str, sort: str, text: str, *, once: bool
) -> int:
    """Show the health of each entity of SYSTEM in the last period.

    Calls in a second, callback times, the share of a processor, messages that wait in the queue;
    and since the start dropped messages, late ticks and errors. SYSTEM is its name; if only one
    runs, it need not be named; of a FILE that declares hosts, all of these are asked.
    Where the output is no terminal that can draw, as JSON, and of several hosts, it is printed
    once.
    """
    view = View(sort=sort, text=text)
    if _are_files(words):
        from composer.cli.hosts.across import top_across

        return top_across(words, view, format_name=format_name)
    from composer.cli.running.top import top

    return top(_system_of(words), view, once=once, format_name=format_name)


@click.command('reload')
@_system
@_timeout
@click.option(
    '--now',
    'aborts_goals',
    is_flag=True,
    help='Abort goals in flight of actions that go, which it waits for otherwise.',
)
def reload_command(words: tuple[str, ...], timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let SYSTEM read its files again, and become what they say.

    SYSTEM is its name, that of its file without the ending; if only one runs, it need not be
    named; of a FILE that declares hosts, all of these are told. If the files have errors, it runs
    on as it was.
    """
    if _are_files(words):
        from composer.cli.hosts.across import reload_across

        return reload_across(words, timeout_sec, aborts_goals=aborts_goals)
    from composer.cli.running.commanding import reload

    return reload(_system_of(words), timeout_sec, aborts_goals=aborts_goals)


@click.command('restart')
@click.argument('node')
@_timeout
def restart_command(node: str, timeout_sec: float) -> int:
    """Build NODE of a running system anew.

    Its entities, parameters and state are as at the start again. NODE is its full name, or what
    follows the last slash of it.
    """
    from composer.cli.running.commanding import restart

    return restart(node, timeout_sec)


@click.command('down')
@_system
@_timeout
def down_command(words: tuple[str, ...], timeout_sec: float) -> int:
    """Stop SYSTEM, and wait until it has stopped.

    SYSTEM is its name; if only one runs, it need not be named. A FILE that declares hosts is
    stopped on all of them, until they boot or are deployed to.
    """
    if _are_files(words):
        from composer.cli.hosts.across import down_across

        return down_across(words, timeout_sec)
    from composer.cli.running.commanding import down

    return down(_system_of(words), timeout_sec)


@click.command('logs')
@_system
@click.option('--follow', '-f', 'follows', is_flag=True, help='Go on until the system ends.')
def logs_command(words: tuple[str, ...], *, follows: bool) -> int:
    """Print what SYSTEM on this host has said.

    It must write to a file, as 'composer up --detach' does. Of one that has ended, the last log is
    printed. Of a FILE that declares hosts, their logs are printed, each line with its host.
    """
    if _are_files(words):
        from composer.cli.hosts.across import logs_across

        return logs_across(words, follows=follows)
    from composer.cli.running.log_files import show_logs

    return show_logs(_system_of(words), follows=follows)


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
    '--format',
    'format_name',
    type=click.Choice(['yaml', 'nodl', 'nodl-xml']),
    default='yaml',
    show_default=True,
    help='What to write: processes of a system, or a NoDL document.',
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
def capture_command(
    nodes: tuple[str, ...], output: Path | None, format_name: str, timeout_sec: float
) -> int:
    """Write down what the nodes on this ROS graph have.

    Each NODE, or all nodes, with publishers, subscriptions, services, clients and actions, their
    types and QoS, and with parameters: to paste under `processes:`, so that `composer check`
    knows what they have. NODE is a full name, or what follows the last slash of it. If a node
    does not say its parameters, the exit code is 1.
    """
    from composer.cli.running.capture import capture

    return capture(nodes, format_name=format_name, output=output, timeout_sec=timeout_sec)


@click.command('suggest', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--recording',
    type=click.Path(path_type=Path),
    metavar='RECORDING',
    help='A recording with /diagnostics, as an MCAP file or a folder of rosbag2. '
    'Default: the running system of this name.',
)
@click.option(
    '--seconds',
    type=click.FloatRange(min=0),
    default=10.0,
    show_default=True,
    metavar='SEC',
    help='How long to watch the running system.',
)
@click.option(
    '--cores',
    type=click.IntRange(min=1),
    metavar='N',
    help='How many processor cores there are. Default: those of where it was measured.',
)
@click.option('--host', default='', metavar='NAME', help='The host whose part is meant.')
@click.option(
    '-o',
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='LAYER',
    help='Write the layer file for it.',
)
@click.option(
    '--format',
    'format_name',
    type=click.Choice(['text', 'json']),
    default='text',
    show_default=True,
    help='The output format.',
)
def suggest_command(  # noqa: PLR0913 - one for each option
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    *,
    recording: Path | None,
    seconds: float,
    cores: int | None,
    host: str,
    output: Path | None,
    format_name: str,
) -> int:
    """Suggest which nodes of FILE should run in workers.

    From what its callbacks cost while it ran: the running system of that name is watched, or a
    recording of /diagnostics is read. The result is a layer, as in 'composer up FILE split.yaml',
    with the gain to expect.
    """
    from composer.cli.running.suggest import SuggestOptions, suggest

    paths, values = split_words(words)
    options = SuggestOptions(recording, seconds, cores, host, output, format_name)
    return suggest(paths, values, set_values, options)


COMMANDS = (
    capture_command,
    ps_command,
    top_command,
    suggest_command,
    logs_command,
    reload_command,
    restart_command,
    down_command,
)
