"""Runs commands on the hosts of a system: those that are asked for what runs there."""

from __future__ import annotations

import asyncio
import shlex
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.hosts.connection import HostConnectionError, connect, import_asyncssh
from composer.hosts.host_parts import unit_of
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from composer.language.specs import HostSpec

_NOT_FOUND = (126, 127)
_MORE_SEC = 30.0


@record
class Reply:
    """What came of a command.

    Attributes:
        host: The host.
        code: Its exit code; `None` if the host could not be asked.
        output: What it printed to its standard output.
        error: What it printed to its standard error, or why the host could not be asked.
    """

    host: HostSpec
    code: int | None
    output: str
    error: str

    @property
    def is_deployed(self) -> bool:
        """Whether the host has the system."""
        return self.code not in _NOT_FOUND


async def ask_composer(
    system: str, hosts: Sequence[HostSpec], *words: str, timeout_sec: float = _MORE_SEC
) -> list[Reply]:
    """Run a command of Composer on each host, for its part of a system.

    Args:
        words: The command and its options; the name of the part comes after the first.
    """

    def line(host: HostSpec) -> str:
        return composer_command(system, host, *words)

    return await ask_all(hosts, line, timeout_sec)


async def ask_all(
    hosts: Sequence[HostSpec], line: Callable[[HostSpec], str], timeout_sec: float
) -> list[Reply]:
    """Run a command line on each host, at the same time; return what came of it."""

    async def ask(host: HostSpec) -> Reply:
        try:
            async with await connect(host) as connection:
                done = await asyncio.wait_for(connection.run(line(host)), timeout_sec + _MORE_SEC)
        except HostConnectionError as error:
            return Reply(host, None, '', f'{error}')
        except (OSError, TimeoutError, import_asyncssh().Error) as error:
            reason = str(error) or 'no answer'
            return Reply(host, None, '', f'host {host.name} ({host.address}) was lost: {reason}')
        return Reply(host, done.exit_status, str(done.stdout), str(done.stderr))

    return list(await asyncio.gather(*map(ask, hosts)))


def composer_command(system: str, host: HostSpec, *words: str) -> str:
    """Return the command line that runs Composer for a part; see `ask_composer`."""
    command, *options = words
    program = f'{host.folder}/systems/{shlex.quote(system)}/live/composer'
    return f'{program} {shlex.join([command, f"{system}@{host.name}", *options])}'


def state_command(system: str, host: HostSpec) -> str:
    """Return the command line that prints whether the unit of a part is active."""
    return f'{systemctl(host)} is-active -- {shlex.quote(unit_of(system, host))}'


def stop_command(system: str, host: HostSpec) -> str:
    """Return the command line that stops a part, and waits until it has stopped."""
    return f'{systemctl(host)} stop -- {shlex.quote(unit_of(system, host))}'


def systemctl(host: HostSpec) -> str:
    """Return the command of systemd that knows the unit of a part."""
    return 'systemctl --user' if host.systemd == 'user' else 'systemctl'


async def follow_all(
    hosts: Sequence[HostSpec],
    line: Callable[[HostSpec], str],
    take: Callable[[HostSpec, str], None],
) -> list[str]:
    """Run a command line on each host, and take its lines as they come.

    Returns:
        Why hosts could not be asked, or were lost.
    """

    async def follow(host: HostSpec) -> str | None:
        asyncssh = import_asyncssh()
        try:
            async with await connect(host) as connection:
                process = await connection.create_process(line(host), errors='backslashreplace')
                async for text in process.stdout:
                    take(host, text.rstrip('\n'))
                done = await process.wait()
        except HostConnectionError as error:
            return str(error)
        except (OSError, asyncssh.Error) as error:
            return f'host {host.name} ({host.address}) was lost: {error}'
        if done.exit_status is None:
            return f'host {host.name} ({host.address}) was lost'
        problem = str(done.stderr).strip()
        return f'host {host.name}: {problem}' if done.exit_status and problem else None

    async def run(step: Awaitable[str | None]) -> str | None:
        try:
            return await step
        except ComposerError as error:
            return str(error)

    found = await asyncio.gather(*(run(follow(host)) for host in hosts))
    return [each for each in found if each is not None]
