"""The command line: arguments in, exit code out. Only here an exception becomes an exit code."""

from __future__ import annotations

import io
import platform
import re
import sys
import traceback
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import click

from composer.errors import ComposerError, ExitCode, UsageError

_DISTRIBUTION = 'rclpy-composer'
_LOG_LEVEL = re.compile(r'([\w/.]+:=)?(debug|info|warn|error|fatal)', re.IGNORECASE)


def main() -> None:
    """Run the command that the process was started with, and exit with its code."""
    for stream in (sys.stdout, sys.stderr):
        # File names and YAML may hold what the terminal's encoding has no character for.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run a command and return its exit code; nothing is raised."""
    try:
        own, ros_arguments = split_ros_arguments(arguments)
        return int(cli.main(own, 'composer', standalone_mode=False, obj=ros_arguments) or 0)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return ExitCode.USAGE
    except (KeyboardInterrupt, click.Abort):
        return ExitCode.FAILED
    except ComposerError as error:
        click.echo(f'error: {error}', err=True)
        if error.help:
            click.echo(f'  help: {error.help}', err=True)
        return ExitCode.USAGE if isinstance(error, UsageError) else ExitCode.FAILED
    except BrokenPipeError:
        # Whoever read our output has gone; there is nobody to tell.
        sys.stderr.close()
        return ExitCode.FAILED
    except Exception:  # noqa: BLE001 - what gets here is a bug of Composer's own
        click.echo(_bug_report(arguments), err=True)
        return ExitCode.BUG


def split_ros_arguments(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Take what stands between `--ros-args` and `--` (or the end) out of a command line.

    Source: https://docs.ros.org/en/jazzy/How-To-Guides/Node-arguments.html
    """
    own: list[str] = []
    ros: list[str] = []
    inside = False
    for argument in arguments:
        if argument == '--ros-args':
            inside = True
        elif inside and argument == '--':
            inside = False
        else:
            (ros if inside else own).append(argument)
    return own, ros


def _check_log_levels(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    for value in values:
        if not _LOG_LEVEL.fullmatch(value):
            message = f"'{value}' is no level: debug, info, warn, error, fatal, or NODE:=LEVEL"
            raise click.BadParameter(message)
    return values


def _version() -> str:
    try:
        return version(_DISTRIBUTION)
    except PackageNotFoundError:
        return 'of a source tree'


@click.group(context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(_version(), prog_name='composer')
def cli() -> None:
    """Run ROS 2 systems that are declared in YAML."""


@cli.command('up')
@click.argument('file', type=click.Path(path_type=Path))
@click.option(
    '--log-level',
    'log_levels',
    multiple=True,
    metavar='[NODE:=]LEVEL',
    callback=_check_log_levels,
    help='debug, info, warn, error or fatal; of all nodes, or of one. Wins over the file.',
)
@click.pass_obj
def up_command(ros_arguments: list[str], file: Path, log_levels: tuple[str, ...]) -> int:
    """Check FILE, then run the system that it declares until it is stopped.

    What follows --ros-args (up to the end, or a --) goes to every node.
    """
    from composer.commands.up import up

    return up(file, ros_arguments, log_levels)


@cli.command('check')
@click.argument('files', nargs=-1, required=True, type=click.Path(path_type=Path))
def check_command(files: tuple[Path, ...]) -> int:
    """Say all that is wrong with FILES, without running anything. Needs no ROS."""
    from composer.commands.check import check

    return check(files)


def _bug_report(arguments: list[str]) -> str:
    return '\n'.join(
        [
            'This is a bug in Composer, not in your file. Please report it with what follows.',
            f'  composer {_version()}, Python {platform.python_version()}, {platform.platform()}',
            f'  arguments: {arguments}',
            traceback.format_exc().rstrip(),
        ]
    )
