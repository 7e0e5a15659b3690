"""Run a command line and return its exit code; only this file turns exceptions into exit codes."""

from __future__ import annotations

import errno
import faulthandler
import gc
import io
import os
import stat
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, TypeGuard

import click

from composer import signals
from composer.cli.commands import cli
from composer.errors import ComposerError, ExitCode, UsageError
from composer.terminal import escape_lines

if TYPE_CHECKING:
    from typing_extensions import Buffer

_LONGEST_EXIT_SEC = 10.0
_MACHINE_ERRORS = {
    *(errno.ENOENT, errno.EAGAIN, errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.ENOSPC),
    errno.ENOSYS,
}


def main() -> None:
    """Run the command line of this process, and exit with its code."""
    _open_closed_streams()
    for name in ('stdout', 'stderr'):
        stream = getattr(sys, name)
        # File names and YAML may have characters that the terminal's encoding lacks.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
            setattr(sys, name, _without_reader(stream))
    code = _flush(run(sys.argv[1:]))
    if 'rclpy' not in sys.modules:
        # Python would look for garbage in all that is left, a tenth of a check's time. Only what
        # ROS made may have to be destroyed.
        gc.freeze()
    signals.end_with(code)
    # Threads and `atexit` functions of behaviours must not keep the process alive.
    with suppress(RuntimeError, ValueError):
        faulthandler.dump_traceback_later(_LONGEST_EXIT_SEC, exit=True)
    sys.exit(code)


class _PipeOutput(io.FileIO):
    """A pipe whose reader may go, as `head` does: the command ends as it would with one."""

    def write(self, data: Buffer, /) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes


def _without_reader(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    """Return a stream that nobody needs to read; the same one if it is no pipe."""
    if not stat.S_ISFIFO(os.fstat(stream.fileno()).st_mode):
        return stream
    return io.TextIOWrapper(
        io.BufferedWriter(_PipeOutput(stream.fileno(), 'w', closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


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
        return ExitCode.INTERRUPTED
    except ComposerError as error:
        _print_error(str(error), error.help)
        return ExitCode.USAGE if isinstance(error, UsageError) else ExitCode.FAILED
    except SystemExit:
        # Of click: the reader of our output has gone, as `head` does.
        return ExitCode.FAILED
    except Exception as error:  # noqa: BLE001 - all that is left is a bug in Composer
        known = _explain_machine(error)
        if known is None:
            _print(_bug_report(arguments))
            return ExitCode.BUG
        _print_error(*known)
        return ExitCode.FAILED


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
    text = f'error: {message}\nhelp: {help}' if help else f'error: {message}'
    _print(escape_lines(text))


def _print(text: str) -> None:
    # Nobody can be told that standard error cannot be written either.
    with suppress(OSError):
        click.echo(text, err=True)


def _open_closed_streams() -> None:
    """Open the null device for each standard stream that a shell has closed, as `>&-` does.

    Else the next file or socket would get its number, and be written to by all that prints.
    """
    for descriptor, name in enumerate(('stdin', 'stdout', 'stderr')):
        try:
            os.fstat(descriptor)
        except OSError:
            # The lowest number that is free is this one.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            stream = open(descriptor, 'w' if descriptor else 'r', encoding='utf-8')  # noqa: PTH123, SIM115 - open until the end
            setattr(sys, name, stream)


def _flush(code: int) -> int:
    """Write what behaviours have printed; return the exit code."""
    for name in ('stdout', 'stderr'):
        try:
            getattr(sys, name).flush()
        except (OSError, ValueError) as error:
            if isinstance(error, OSError):
                code = code or ExitCode.FAILED
            # Python would try again at the exit, and complain.
            setattr(sys, name, None)
    return code


def _is_of_output(error: Exception) -> TypeGuard[OSError]:
    """Return whether an error is one of standard output or error, as where the disk is full."""
    import traceback

    frames = list(traceback.walk_tb(error.__traceback__))
    return isinstance(error, OSError) and frames[-1][0].f_code is click.echo.__code__


def _explain_machine(error: Exception) -> tuple[str, str | None] | None:
    """Return message and help of an error of the machine, not of Composer; else `None`."""
    import tempfile

    from composer.processes.kernel import THREADS_HELP

    if _is_of_output(error):
        return f'cannot write the output: {error.strerror}', None
    if isinstance(error, MemoryError):
        return 'out of memory', None
    if str(error) == "can't start new thread":
        return str(error), THREADS_HELP
    if isinstance(error, ImportError) and 'failed to map segment' in str(error):
        return str(error), None
    if not isinstance(error, OSError) or error.errno not in _MACHINE_ERRORS:
        return None
    if error.errno != errno.ENOENT:
        return str(error), None
    try:
        tempfile.gettempdir()
    except FileNotFoundError:
        message = 'no folder for temporary files can be written to'
        return message, 'set TMPDIR, or mount a tmpfs at /tmp'
    return None


def _translate(error: click.ClickException) -> tuple[str, str]:
    """Return message and help of an error of click, in the form of our own errors."""
    message = error.format_message().removesuffix('.')
    context = getattr(error, 'ctx', None)
    command = context.command_path if context else 'composer'
    return message[:1].lower() + message[1:], f"'{command} --help' shows the usage"


def _bug_report(arguments: list[str]) -> str:
    import platform
    import traceback

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
