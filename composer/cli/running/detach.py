"""`composer up --detach`: start a system, and give the terminal back once all of it is up."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import time
from typing import TYPE_CHECKING

import click

from composer import signals
from composer.errors import ComposerError, ExitCode
from composer.programs import own_command
from composer.runtime.control.readiness import VARIABLE
from composer.runtime.environment import check_ros, find_log_folder
from composer.terminal import escape_output

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_MOST_BYTES = 4096


def start_detached(path: Path, arguments: Sequence[str], host: str = '') -> int:
    """Start a system in a session of its own, and wait until it is up; return the exit code.

    If it does not come up, all that it has printed is printed here.

    Args:
        path: Its file.
        arguments: Those after `composer up`.
        host: The host whose part it is; empty for the whole system.

    Raises:
        RosNotFoundError: There is no rclpy.
        ComposerError: Its log cannot be written.
    """
    check_ros()
    log = _log_path(path, host)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ready:
        # The kernel finds a free name.
        ready.bind('')
        address = f'@{ready.getsockname()[1:].decode()}'
        with signals.interrupting():
            process = _start(path, arguments, log, address)
            try:
                is_up = _wait(process, ready)
            except KeyboardInterrupt:
                # It has a session of its own, so the terminal does not tell it.
                process.send_signal(signal.SIGINT)
                process.wait()
                raise
    text = log.read_text(encoding='utf-8', errors='backslashreplace')
    click.echo(escape_output(text), nl=False, err=True)
    if is_up:
        click.echo(f'process {process.pid}, log {log}', err=True)
        return ExitCode.DONE
    log.unlink()
    code = process.wait()
    return code if code > 0 else ExitCode.FAILED


def _start(
    path: Path, arguments: Sequence[str], log: Path, address: str
) -> subprocess.Popen[bytes]:
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        stream = log.open('xb')
    except OSError as error:
        message = f'the log cannot be written to {log}: {error.strerror}'
        raise ComposerError(message) from error
    with stream:
        return subprocess.Popen(  # noqa: S603 - ourselves
            [*own_command(), 'up', *arguments],
            stdin=None if str(path) == '-' else subprocess.DEVNULL,
            stdout=stream,
            stderr=stream,
            start_new_session=True,
            env={**os.environ, VARIABLE: address},
        )


def _wait(process: subprocess.Popen[bytes], ready: socket.socket) -> bool:
    """Wait until a process says that it is up, or ends; return whether it is up."""
    ended = os.pidfd_open(process.pid)
    try:
        while True:
            readable, _, _ = select.select([ready.fileno(), ended], [], [])
            if ready.fileno() in readable:
                if b'READY=1' in ready.recv(_MOST_BYTES).split(b'\n'):
                    return True
            elif ended in readable:
                return False
    finally:
        os.close(ended)


def _log_path(path: Path, host: str) -> Path:
    name = '<stdin>' if str(path) == '-' else path.stem
    name = f'{name}@{host}' if host else name
    stamp = time.strftime('%Y%m%d-%H%M%S')
    return find_log_folder() / f'{log_prefix(name)}{stamp}_{os.getpid()}.log'


def log_prefix(name: str) -> str:
    """Return what the names of the logs begin with that a system of this name writes."""
    safe = ''.join(each if each.isalnum() or each in '-.' else '-' for each in name)
    return f'composer_{safe}_'
