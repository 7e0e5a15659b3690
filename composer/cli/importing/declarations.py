"""Declare `composer import`: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.common.argument_types import NUMBERS_ARE_VALUES, refuse_options


@click.command('import', context_settings=NUMBERS_ARE_VALUES)
@click.argument('file', type=click.Path(path_type=Path))
@click.argument('words', nargs=-1, metavar='[NAME:=VALUE]...')
@click.option(
    '--output',
    '-o',
    type=click.Path(path_type=Path),
    help='Write the system to this file, and its parameter files beside it. Default: print it.',
)
@click.option(
    '--verify',
    'verifies',
    is_flag=True,
    help='Also run both with stand-ins for their programs, and compare what each is given.',
)
def import_command(
    file: Path, words: tuple[str, ...], output: Path | None, *, verifies: bool
) -> int:
    """Turn the launch file FILE into a system.

    This runs the code of the launch file, and the commands in it: import only what you trust.

    It is resolved by the installed launch and launch_ros, with these values for its arguments. All
    of its arguments remain arguments of the system; those that Python code of it reads keep these
    values. What cannot be kept is a comment with the line that it comes from.
    """
    from composer.cli.importing.import_launch import import_launch_file

    refuse_options((str(file), *words))
    return import_launch_file(file, words, output, verifies=verifies)
