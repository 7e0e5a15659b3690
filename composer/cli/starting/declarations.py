"""Declare `composer up`: see `composer.cli.commands`."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import IO

import click

from composer.application.recording_options import RecordingOptions
from composer.cli.common.argument_types import (
    FOXGLOVE_PORT,
    LAST_PORT,
    NUMBERS_ARE_VALUES,
    bridge_options,
    check_log_levels,
    split_words,
    takes_bridge,
    takes_host,
    takes_system,
    takes_topics,
)
from composer.errors import ExitCode
from composer.terminal import escape

# By default.
_PORTS = {'--foxglove': FOXGLOVE_PORT, '--page': 0}


class _Up(click.Command):
    """Takes `--foxglove` and `--page` before a file, too: their port may be left out."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        for i, (word, following) in enumerate(pairwise(args)):
            if word in _PORTS and not following.isdecimal():
                args[i] = f'{word}={_PORTS[word]}'
        return super().parse_args(ctx, args)


@click.command('up', cls=_Up, context_settings={**NUMBERS_ARE_VALUES, 'help_option_names': []})
@takes_system
@click.option(
    '--log-level',
    'log_levels',
    multiple=True,
    metavar='[NODE:=]LEVEL',
    callback=check_log_levels,
    help='Set the log level (debug, info, warn, error or fatal) of all nodes, or of one. '
    'Overrides the file. Can be repeated.',
)
@takes_host
@click.option(
    '--watch', 'watches', is_flag=True, help='Change the running system when its files change.'
)
@click.option(
    '--detach',
    '-d',
    'detaches',
    is_flag=True,
    help="Give the terminal back once all of it is up. 'composer logs' shows what it says.",
)
@click.option(
    '--no-control',
    'is_asked',
    is_flag=True,
    default=True,
    flag_value=False,
    help="Leave out the services that 'composer reload', 'down' and the like use.",
)
@click.option(
    '--record',
    type=click.Path(path_type=Path),
    metavar='FILE',
    help='Record its topics to this MCAP file; a name without .mcap is a folder of rosbag2.',
)
@takes_topics
@click.option(
    '--trace',
    type=click.File('w', 'utf-8', lazy=False),
    metavar='FILE',
    help='Write a timeline of all callbacks to this file, which Perfetto opens.',
)
@click.option(
    '--foxglove',
    'port',
    type=click.IntRange(0, LAST_PORT),
    is_flag=False,
    flag_value=FOXGLOVE_PORT,
    metavar='[PORT]',
    help=f'Show it to Foxglove at this port; 0 for any, {FOXGLOVE_PORT} by default.',
)
@takes_bridge
@click.option(
    '--page',
    'page_port',
    type=click.IntRange(0, LAST_PORT),
    is_flag=False,
    flag_value=0,
    metavar='[PORT]',
    help="Serve its page beside it, as 'composer page' does; any free port by default.",
)
@click.option(
    '--hold',
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='Create all nodes, but run no behaviour while this file is there, for 60 s at most.',
)
@click.option(
    '--help', '-h', 'wants_help', is_flag=True, help='Show this help and the arguments of FILE.'
)
@click.pass_context
def up_command(  # noqa: PLR0913 - one for each option
    context: click.Context,
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    log_levels: tuple[str, ...],
    host: str,
    *,
    watches: bool,
    detaches: bool,
    allows_changes: bool,
    is_asked: bool,
    record: Path | None,
    topics: tuple[str, ...],
    trace: IO[str] | None,
    port: int | None,
    address: str | None,
    page_port: int | None,
    hold: Path | None,
    wants_help: bool,
) -> int:
    """Check FILE, then run its system until it is stopped.

    Each LAYER (.yaml or .yml) changes the files before it. Give the arguments that FILE declares
    by name, NAME:=VALUE, or in their order, VALUE. ROS arguments follow --ros-args and go to every
    node.
    """
    from composer.application.up import up

    if wants_help:
        click.echo(context.get_help())
        if words:
            paths, _ = split_words(words)
            click.echo(f'\n{escape(str(paths[0]))}: {_describe_arguments(paths)}')
        return ExitCode.DONE
    paths, arguments = split_words(words)
    if detaches:
        from composer.cli.running.detach import start_detached

        options = [f'--set={each}' for each in set_values]
        options += [f'--log-level={each}' for each in log_levels]
        options += [f'--host={host}'] * bool(host)
        options += ['--watch'] * watches + ['--no-control'] * (not is_asked)
        options += [f'--record={record}'] * (record is not None)
        options += [f'--topics={each}' for each in topics]
        options += [] if trace is None else [f'--trace={trace.name}']
        options += [] if port is None else [f'--foxglove={port}']
        options += [] if address is None else [f'--listen={address}']
        options += ['--allow-changes'] * allows_changes
        options += [] if page_port is None else [f'--page={page_port}']
        options += [f'--hold={hold}'] * (hold is not None)
        given = [*options, *words, '--ros-args', *context.obj, '--']
        return start_detached(paths[0], given, host)
    for_page_alone = page_port is not None and port is None
    return up(
        paths,
        arguments,
        context.obj,
        log_levels,
        set_values,
        host=host,
        watches=watches,
        is_asked=is_asked,
        recording=RecordingOptions(
            record,
            topics,
            bridge_options(port, address, allows_changes=allows_changes and not for_page_alone),
            page_port,
            allows_changes,
        ),
        hold=hold,
        trace=trace,
        ends_process=True,
    )


def _describe_arguments(paths: list[Path]) -> str:
    """Return the arguments that a file declares, as `--help` shows them."""
    from composer.application.file_selection import load_given
    from composer.language.arguments import describe_arguments

    system = load_given(paths)
    return (
        'the file cannot be read' if system.spec is None else describe_arguments(system.arguments)
    )
