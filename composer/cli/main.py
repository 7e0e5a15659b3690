"""Run a command line and return its exit code; only this file turns exceptions into exit codes."""

from __future__ import annotations

import faulthandler
import io
import platform
import sys
import traceback
from contextlib import suppress

import click

from composer.cli.commands import cli
from composer.errors import ComposerError, ExitCode, UsageError

_LONGEST_EXIT_SEC = 10.0


def main() -> None:
    """Run the command line of this process, and exit with its code."""
    for stream in (sys.stdout, sys.stderr):
        # File names and YAML may have characters that the terminal's encoding lacks.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    code = run(sys.argv[1:])
    # Threads and `atexit` functions of behaviours must not keep the process alive.
    with suppress(RuntimeError, ValueError):
        faulthandler.dump_traceback_later(_LONGEST_EXIT_SEC, exit=True)
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run a command and return its exit code; raise nothing."""
    try:
        own, ros_arguments = split_ros_arguments(arguments)
        return int(cli.main(own, 'composer', standalone_mode=False, obj=ros_arguments) or 0)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        _print_error(*_translate(error))
        return ExitCode.USAGE
    except (KeyboardInterrupt, click.Abort):
        return ExitCode.FAILED
    except ComposerError as error:
        _print_error(str(error), error.help)
        return ExitCode.USAGE if isinstance(error, UsageError) else ExitCode.FAILED
    except BrokenPipeError:
        # The reader of our output has gone, as `head` does.
        sys.stderr.close()
        return ExitCode.FAILED
    except Exception:  # noqa: BLE001 - all that is left is a bug in Composer
        click.echo(_bug_report(arguments), err=True)
        return ExitCode.BUG


def split_ros_arguments(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Split a command line into its own arguments and those after `--ros-args`, up to a `--`.

    Returns:
        The own arguments, and the ROS arguments.

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


def _print_error(message: str, help: str | None) -> None:  # noqa: A002 - the word that is printed
    click.echo(f'error: {message}', err=True)
    if help:
        click.echo(f'  help: {help}', err=True)


def _translate(error: click.ClickException) -> tuple[str, str]:
    """Return message and help of an error of click, in the form of our own errors."""
    message = error.format_message().removesuffix('.')
    context = getattr(error, 'ctx', None)
    command = context.command_path if context else 'composer'
    return message[:1].lower() + message[1:], f"'{command} --help' shows the usage"


def _bug_report(arguments: list[str]) -> str:
    from composer.version import find_version

    python = f'Python {platform.python_version()}, {platform.platform()}'
    return '\n'.join(
        [
            'This is a bug in Composer, not in your file. Please report it with the lines below.',
            f'  composer {find_version()}, {python}',
            f'  arguments: {arguments}',
            traceback.format_exc().rstrip(),
        ]
    )
