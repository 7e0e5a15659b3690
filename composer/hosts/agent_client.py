"""Asks the agent of a host: see `composer.hosts.agent.conversation`."""

from __future__ import annotations

import asyncio
import io
import json
import shlex
import time
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.hosts import agent
from composer.hosts.connection import connect, import_asyncssh

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import HostSpec

# Must be able to run on any Python, to say that it is too old.
_BOOTSTRAP = r"""
import os, sys, json
os.write(1, (json.dumps(list(sys.version_info[:3])) + "\n").encode())
if sys.version_info < (3, 11): sys.exit(0)
def read(count):
    data = b""
    while len(data) < count:
        more = os.read(0, count - len(data))
        if not more: sys.exit(0)
        data += more
    return data
sizes = [int(read(10)), int(read(10))]
code, options = [read(each) for each in sizes]
file = os.memfd_create("composer")
os.write(file, code)
sys.path.insert(0, "/proc/self/fd/%d" % file)
from composer.hosts.agent.conversation import main
main(json.loads(options))
"""
_PING_SEC = 3.0
_SILENCE_SEC = 15.0
_PART = 1 << 18
_OLDEST = [3, 11]
_NOT_FOUND = (126, 127)
# What has printed something in place of Python's version may be waiting for more.
_END_SEC = 1.0
_MOST_SAID = 500


class HostLostError(ComposerError):
    """A host does not answer any more."""


class HostRefusedError(ComposerError):
    """A host could not do what it was told."""


class HostAgent:
    """The agent on a host; `open` starts it.

    Attributes:
        host: The host.
        is_lost: Whether it does not answer any more.
    """

    def __init__(self, host: HostSpec) -> None:
        self.host = host
        self.is_lost = False
        self._connection: Any = None
        self._process: Any = None
        self._answers: dict[int, asyncio.Future[Any]] = {}
        self._tasks: list[asyncio.Task[None]] = []
        self._count = 0
        self._heard_sec = 0.0
        self._reason = 'the connection has ended'

    async def open(self, options: Mapping[str, Any]) -> None:
        """Connect, and start it.

        Args:
            options: See `composer.hosts.agent.conversation.main`.

        Raises:
            ComposerError: The host cannot be reached, or its Python cannot run Composer.
        """
        self._connection = await connect(self.host)
        python = self.host.python
        quoted = python if python.startswith('~/') else shlex.quote(python)
        command = f'exec {quoted} -I -c {shlex.quote(_BOOTSTRAP)}'
        try:
            self._process = await self._connection.create_process(command, encoding=None)
            await self._check_python()
            code, told = _agent_archive(), json.dumps(dict(options)).encode()
            self._process.stdin.write(f'{len(code):10}{len(told):10}'.encode() + code + told)
        except (OSError, import_asyncssh().Error) as error:
            raise self._lose(str(error)) from error
        self._tasks = [asyncio.create_task(self._read()), asyncio.create_task(self._ping())]

    async def _check_python(self) -> None:
        try:
            line = await asyncio.wait_for(self._process.stdout.readline(), _SILENCE_SEC)
        except TimeoutError as error:
            msg = 'its Python does not answer'
            raise self._lose(msg) from error
        version = _read_version(line)
        if not version:
            raise await self._explain_answer(line)
        if version[:2] < _OLDEST:
            found = '.'.join(map(str, version))
            message = (
                f"host {self.host.name}: '{self.host.python}' is Python {found}, "
                'and Composer needs 3.11 or newer'
            )
            raise HostRefusedError(message, help="name a newer one by 'python:'")

    async def _explain_answer(self, line: bytes) -> HostRefusedError:
        """Return why what a host has answered at first is not that of its Python."""
        host, python = self.host.name, self.host.python
        said, code = line, None
        with suppress(TimeoutError):
            done = await asyncio.wait_for(self._process.wait(), _END_SEC if line else _SILENCE_SEC)
            said, code = line + (done.stdout or b'') + (done.stderr or b''), done.exit_status
        if code in _NOT_FOUND and not line:
            advice = "install Python 3.11 or newer there, or name it by 'python:'"
            return HostRefusedError(f"host {host} has no Python '{python}'", help=advice)
        text = said.decode(errors='replace').strip()[:_MOST_SAID] or 'nothing'
        ended = '' if code is None else f' (exit code {code})'
        message = (
            f"host {host}: the login ran '{python}' to run Composer, which did not answer as "
            f'Python does. It printed: {text}{ended}'
        )
        advice = (
            'a login must run commands, and print nothing of its own (as in ~/.bashrc); '
            "'python:' names a Python of 3.11 or newer"
        )
        return HostRefusedError(message, help=advice)

    async def call(self, operation: str, data: bytes = b'', **words: Any) -> Any:
        """Let it do something; return what comes of it.

        Raises:
            HostRefusedError: It could not.
            HostLostError: It does not answer any more.
        """
        if self.is_lost:
            raise self._lose(self._reason)
        self._count += 1
        number = self._count
        request = {'id': number, 'do': operation, **words}
        if data:
            request['bytes'] = len(data)
        answer = self._answers[number] = asyncio.get_running_loop().create_future()
        try:
            self._process.stdin.write(json.dumps(request).encode() + b'\n' + data)
            await self._process.stdin.drain()
            return await answer
        except (OSError, import_asyncssh().Error) as error:
            raise self._lose(str(error)) from error
        finally:
            self._answers.pop(number, None)

    async def bring(self, operation: str, name: str, data: bytes) -> None:
        """Bring it a file, in parts: each is answered, so a slow line is not taken for a lost one.

        Args:
            operation: What it does with the whole.
        """
        rest = data
        while len(rest) > _PART:
            await self.call('receive_part', rest[:_PART])
            rest = rest[_PART:]
        await self.call(operation, rest, name=name)

    async def close(self) -> None:
        """End the connection, and with it the agent."""
        for task in self._tasks:
            task.cancel()
        if self._process is not None and not self.is_lost:
            with suppress(OSError, import_asyncssh().Error, TimeoutError):
                self._process.stdin.write_eof()
                await asyncio.wait_for(self._process.wait(), _SILENCE_SEC)
        if self._connection is not None:
            self._connection.abort() if self.is_lost else self._connection.close()

    async def _read(self) -> None:
        reason = self._reason
        try:
            while line := await self._process.stdout.readline():
                self._take(json.loads(line))
        except (ValueError, KeyError, TypeError):
            reason = f'it answered {line[:_MOST_SAID].decode(errors="replace")!r}'
        except (OSError, import_asyncssh().Error) as error:
            reason = str(error) or reason
        self._give_up(reason)

    def _take(self, answer: dict[str, Any]) -> None:
        self._heard_sec = time.monotonic()
        waiting = self._answers.get(answer['id'])
        if waiting is None or waiting.done():
            return
        if 'error' in answer:
            message = f'host {self.host.name}: {answer["error"]}'
            waiting.set_exception(HostRefusedError(message, help=answer['help'] or None))
        else:
            waiting.set_result(answer['result'])

    async def _ping(self) -> None:
        while True:
            await asyncio.sleep(_PING_SEC)
            try:
                await asyncio.wait_for(self.call('ping'), _SILENCE_SEC)
            except TimeoutError:
                # It comes after what is brought.
                if time.monotonic() - self._heard_sec > _SILENCE_SEC:
                    self._give_up(f'no answer within {_SILENCE_SEC:g} s')
            except ComposerError:
                return

    def _give_up(self, reason: str) -> None:
        self.is_lost, self._reason = True, reason
        for waiting in self._answers.values():
            if not waiting.done():
                waiting.set_exception(self._lose(reason))
        if self._connection is not None:
            self._connection.abort()

    def _lose(self, reason: str) -> HostLostError:
        self.is_lost = True
        return HostLostError(f'host {self.host.name} was lost: {reason}')


def _read_version(line: bytes) -> list[int]:
    """Return the version that a Python has told; empty for anything else."""
    with suppress(ValueError):
        told = json.loads(line)
        if isinstance(told, list) and all(isinstance(each, int) for each in told):
            return told
    return []


def _agent_archive() -> bytes:
    """Return the code of the agent, as Python imports it."""
    stream = io.BytesIO()
    folder = Path(agent.__file__).parent
    with zipfile.ZipFile(stream, 'w', zipfile.ZIP_DEFLATED) as archive:
        for package in ('composer', 'composer/hosts'):
            archive.writestr(f'{package}/__init__.py', '')
        for path in sorted(folder.glob('*.py')):
            archive.writestr(f'composer/hosts/agent/{path.name}', path.read_bytes())
    return stream.getvalue()
