"""Arguments in, exit code out. Only here an exception becomes an exit code."""

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
    """Run the command that the process was started with, and exit with its code."""
    for stream in (sys.stdout, sys.stderr):
        # File names and YAML may hold what the terminal's encoding has no character for.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    code = run(sys.argv[1:])
    # What behaviours leave behind, as threads or functions of `atexit`, does not keep the process.
    with suppress(RuntimeError, ValueError):
        faulthandler.dump_traceback_later(_LONGEST_EXIT_SEC, exit=True)
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run a command and return its exit code; nothing is raised."""
    try:
        own, ros_arguments = split_ros_arguments(arguments)
        return int(cli.main(own, 'composer', standalone_mode=False, obj=ros_arguments) or 0)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        _say(*_translate(error))
        return ExitCode.USAGE
    except (KeyboardInterrupt, click.Abort):
        return ExitCode.FAILED
    except ComposerError as error:
        _say(str(error), error.help)
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

    Returns:
        What is left, and what was taken out.

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


def _say(message: str, help: str | None) -> None:  # noqa: A002 - the word that is shown
    click.echo(f'error: {message}', err=True)
    if help:
        click.echo(f'  help: {help}', err=True)


def _translate(error: click.ClickException) -> tuple[str, str]:
    """Return message and help of what click has to say, in the form of all other errors."""
    message = error.format_message().removesuffix('.')
    context = getattr(error, 'ctx', None)
    command = context.command_path if context else 'composer'
    return message[:1].lower() + message[1:], f"'{command} --help' shows how it is used"


def _bug_report(arguments: list[str]) -> str:
    from composer.version import find_version

    python = f'Python {platform.python_version()}, {platform.platform()}'
    return '\n'.join(
        [
            'This is a bug in Composer, not in your file. Please report it with what follows.',
            f'  composer {find_version()}, {python}',
            f'  arguments: {arguments}',
            traceback.format_exc().rstrip(),
        ]
    )
