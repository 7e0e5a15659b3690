"""`composer logs`: show what a system on this host has said that writes to a file."""

from __future__ import annotations

import os
import select
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from composer import signals
from composer.cli.running.detach import log_prefix
from composer.errors import ComposerError, ExitCode, UsageError
from composer.runtime.control.name_claim import list_claims
from composer.runtime.environment import check_shell, find_log_folder
from composer.spelling import suggest
from composer.terminal import escape_output, is_output_unread

if TYPE_CHECKING:
    from typing import BinaryIO

_POLL_SEC = 0.1
_CHUNK = 1 << 16
_ADVICE = "'composer up --detach' writes to a file"


def show_logs(name: str | None, *, follows: bool) -> int:
    """Print the log of a system; return the exit code.

    Args:
        name: Of the system; `None` for the only one on this host.
        follows: Whether to go on until the system ends.

    Raises:
        ComposerError: There is no such system, or no such log.
        UsageError: Several systems run.
    """
    path, pid = _find(name)
    try:
        with path.open('rb') as stream:
            _copy(stream)
            if follows and pid is not None:
                with suppress(KeyboardInterrupt), signals.interrupting():
                    _follow(stream, pid)
    except OSError as error:
        message = f'the log cannot be read from {path}: {error.strerror}'
        raise ComposerError(message) from error
    return ExitCode.DONE


def _find(name: str | None) -> tuple[Path, int | None]:
    """Return the log of a system, and the system's process if that runs."""
    check_shell({})
    domain_id = int(os.environ.get('ROS_DOMAIN_ID') or 0)
    claims = [each for each in list_claims(domain_id) if 'name' in each]
    found = [each for each in claims if name in (None, each['name'])]
    if len(found) > 1:
        listed = ', '.join(_describe(each) for each in found)
        message = f'several systems run on this host (ROS_DOMAIN_ID {domain_id})'
        raise UsageError(message, help=f'name one of them: {listed}')
    if found:
        return _log_of(found[0]), found[0]['pid']
    # The last one that has ended.
    folder = find_log_folder()
    logs = list(folder.glob(f'{log_prefix(name)}*.log')) if name is not None else []
    if logs:
        return max(logs, key=lambda path: path.stat().st_mtime), None
    if name is None:
        message = f'no system runs on this host (ROS_DOMAIN_ID {domain_id})'
        raise ComposerError(message)
    message = f"there is no system '{name}' on this host, and no log of one"
    raise ComposerError(
        message, help=suggest(name, [each['name'] for each in claims], 'there are')
    )


def _log_of(claim: dict[str, Any]) -> Path:
    if claim.get('log') is None:
        message = f"system '{claim['name']}' (pid {claim['pid']}) does not write to a file"
        raise ComposerError(message, help=_ADVICE)
    return Path(claim['log'])


def _describe(claim: dict[str, Any]) -> str:
    return f'{claim["name"]} (pid {claim["pid"]})'


def _copy(stream: BinaryIO) -> None:
    """Print what a file has that was not printed yet."""
    # The rest of a line comes with it: what a terminal obeys may lie on both sides.
    while chunk := stream.read(_CHUNK) + stream.readline(_CHUNK):
        click.echo(escape_output(chunk.decode(errors='backslashreplace')), nl=False)


def _follow(stream: BinaryIO, pid: int) -> None:
    """Print what is added to a file until a process ends."""
    try:
        process = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    try:
        has_ended = False
        while not (has_ended or is_output_unread()):
            has_ended = bool(select.select([process], [], [], _POLL_SEC)[0])
            _copy(stream)
    finally:
        os.close(process)
