"""Declare the commands that record and replay: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.common.argument_types import (
    FOXGLOVE_PORT,
    LAST_PORT,
    bridge_options,
    takes_bridge,
    takes_topics,
)
from composer.errors import ExitCode


@click.command('record')
@click.option(
    '-o',
    '--output',
    type=click.Path(path_type=Path),
    metavar='FILE',
    help='The MCAP file to write; a name without .mcap is a folder of rosbag2. '
    'Default: a folder rosbag2_ with the time.',
)
@takes_topics
def record_command(output: Path | None, topics: tuple[str, ...]) -> int:
    """Record the ROS graph until it is interrupted.

    All topics that are not hidden are recorded, those that come later included, as rosbag2 does.
    """
    from composer.cli.recording.record import record

    return record(output, topics)


@click.command('replay')
@click.argument('file', type=click.Path(path_type=Path))
@click.option(
    '--rate',
    type=click.FloatRange(min=0, min_open=True),
    default=1.0,
    show_default=True,
    metavar='R',
    help='How many times as fast.',
)
@click.option(
    '--start',
    'start_sec',
    type=click.FloatRange(min=0),
    default=0.0,
    metavar='SEC',
    help='Leave out so much of the beginning.',
)
@click.option(
    '--wait',
    'waits',
    is_flag=True,
    help='Begin when each topic has a subscription, however long that takes.',
)
@click.option('--loop', 'loops', is_flag=True, help='Begin again at the end.')
@takes_topics
@click.pass_context
def replay_command(
    context: click.Context,
    file: Path,
    *,
    rate: float,
    start_sec: float,
    waits: bool,
    loops: bool,
    topics: tuple[str, ...],
) -> int:
    """Publish the recording FILE to the ROS graph.

    Its messages come at their times and with their QoS. FILE is an MCAP file, or a folder that
    rosbag2 made of such files. ROS arguments follow --ros-args, as in --ros-args -r /scan:=/raw.
    """
    from composer.cli.recording.replay import replay

    return replay(
        file, topics, context.obj, rate=rate, start_sec=start_sec, waits=waits, loops=loops
    )


@click.command('foxglove')
@click.argument('name', metavar='[SYSTEM]', required=False)
@click.option(
    '--port',
    type=click.IntRange(0, LAST_PORT),
    default=FOXGLOVE_PORT,
    show_default=True,
    metavar='PORT',
    help='Where to serve it; 0 for any that is free.',
)
@takes_bridge
def foxglove_command(
    name: str | None, port: int, address: str | None, *, allows_changes: bool
) -> int:
    """Show SYSTEM to Foxglove.

    All that is on its ROS graph is shown, until it is interrupted. SYSTEM is its name; if only one
    runs, it need not be named.
    """
    from composer.cli.recording.foxglove import serve

    options = bridge_options(port, address, allows_changes=allows_changes)
    return serve(name, options) if options else ExitCode.USAGE


COMMANDS = (record_command, replay_command, foxglove_command)
