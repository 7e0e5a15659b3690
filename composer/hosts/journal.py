"""What a part has said, from the journal of systemd on its host: each line once.

A journal gives each entry a cursor, after which reading goes on when a connection was lost:
https://www.freedesktop.org/software/systemd/man/latest/journalctl.html
"""

from __future__ import annotations

import asyncio
import json
import shlex
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.hosts.asking import follow_all, systemctl
from composer.hosts.host_parts import unit_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import HostSpec

_FIRST_PAUSE_SEC, _LONGEST_PAUSE_SEC = 1.0, 10.0


class JournalReader:
    """Reads what a part has said since its last start.

    Args:
        take: Takes each line.
        tell: Takes what is said of the host itself.

    Attributes:
        has_failed: Whether the host could not be asked, or what it said was not read to its end.
    """

    def __init__(
        self,
        system: str,
        host: HostSpec,
        take: Callable[[str], None],
        tell: Callable[[str], None],
    ) -> None:
        self._host, self._unit = host, shlex.quote(unit_of(system, host))
        self._take, self._tell = take, tell
        self.has_failed = False
        self._cursor = ''
        self._was_reached = self._is_lost = False
        self._pause_sec = _FIRST_PAUSE_SEC

    async def read(self) -> None:
        """Read what there is."""
        for problem in await follow_all([self._host], lambda _: self._command(), self._receive):
            self.has_failed = True
            self._tell(f'error: {problem}')

    async def follow(self) -> None:
        """Read what there is, and what comes; connect again whenever the host is lost."""
        while True:
            problems = await follow_all(
                [self._host], lambda _: f'{self._command()} --follow', self._receive
            )
            if not self._is_lost:
                self._is_lost, self.has_failed = True, not self._was_reached
                problem = problems[0] if problems else f'host {self._host.name} was lost'
                self._tell(f'error: {problem}; trying again')
            await asyncio.sleep(self._pause_sec)
            self._pause_sec = min(2 * self._pause_sec, _LONGEST_PAUSE_SEC)

    def _command(self) -> str:
        """Return the command line that prints entries as JSON, after an empty line."""
        word = '--user-unit' if self._host.systemd == 'user' else '--unit'
        journal = (
            f'journalctl --quiet --no-pager --output=json --all {word}={self._unit} --lines=all'
        )
        if self._cursor:
            return f'echo; {journal} --after-cursor={shlex.quote(self._cursor)}'
        begin = f'$({systemctl(self._host)} show -P ExecMainStartTimestamp -- {self._unit})'
        return f'echo; begun={begin}; {journal} ${{begun:+"--since=$begun"}}'

    def _receive(self, _host: HostSpec, line: str) -> None:
        if not line:
            self._come_back()
            return
        # The last line may have come in part: it comes again.
        with suppress(json.JSONDecodeError):
            entry = json.loads(line)
            for each in _decode(entry.get('MESSAGE')).splitlines():
                self._take(each)
            self._cursor = entry['__CURSOR']

    def _come_back(self) -> None:
        if self._is_lost:
            self._tell(f'host {self._host.name} is there again')
        self._was_reached, self._is_lost, self.has_failed = True, False, False
        self._pause_sec = _FIRST_PAUSE_SEC


def _decode(message: Any) -> str:
    """Return the text of an entry; what is not printable comes as its bytes."""
    if isinstance(message, list):
        return bytes(message).decode(errors='backslashreplace')
    return message or ''
