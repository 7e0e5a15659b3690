"""What keeps an operation from being done on a host, as its user is told."""

from __future__ import annotations

import errno
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_MOST_LINES = 30


class HostError(Exception):
    """An operation could not be done.

    Attributes:
        help: What to do about it; empty if nothing is known.
    """

    def __init__(self, message: str, help: str = '') -> None:  # noqa: A002 - the word
        super().__init__(message)
        self.help = help


def explain(error: Exception) -> tuple[str, str]:
    """Return message and help of an error of an operation."""
    if isinstance(error, HostError):
        return str(error), error.help
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f'the disk is full: {error.filename or "no space left"}', 'free some space'
    if isinstance(error, OSError) and error.filename is not None:
        return f'{error.filename}: {error.strerror}', ''
    return f'{type(error).__name__}: {error}', ''


def run(
    command: Sequence[str],
    *,
    cwd: Path | None = None,
    timeout_sec: float = 900.0,
    variables: Mapping[str, str] | None = None,
) -> str:
    """Run a program; return what it has printed.

    Args:
        variables: What its environment has besides that of this process.

    Raises:
        HostError: It failed; the help is the end of what it has printed.
    """
    try:
        done = subprocess.run(  # noqa: S603 - what the deployment says
            command,
            cwd=cwd,
            env={**os.environ, **(variables or {})},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=timeout_sec,
            check=False,
        )
    except FileNotFoundError as error:
        message = f'there is no program {command[0]}'
        raise HostError(message) from error
    except subprocess.TimeoutExpired as error:
        message = f'{Path(command[0]).name} has not ended within {timeout_sec:g} s'
        raise HostError(message) from error
    text = done.stdout.decode(errors='replace')
    if done.returncode:
        message = f'{" ".join(map(str, command[:4]))} … failed with exit code {done.returncode}'
        raise HostError(message, last_lines(text))
    return text


def last_lines(text: str) -> str:
    """Return the last lines of an output."""
    return '\n'.join(text.rstrip().splitlines()[-_MOST_LINES:])
