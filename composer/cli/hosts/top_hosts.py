"""The screen of `composer top` for a system on several hosts: each sends what it measures."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.application.running_systems import answer_forms
from composer.errors import ComposerError
from composer.hosts.asking import composer_command, follow_all
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.cli.running.top_table import View
    from composer.language.specs import HostSpec

# Before a host is asked again whose part has ended, or that was lost.
_PAUSE_SEC = 2.0
_LISTS = ('entities', 'processes', 'external_processes')


def watch_hosts(system: str, hosts: Sequence[HostSpec], view: View) -> None:
    """Show the health of the entities on all hosts until the user quits."""
    from composer.cli.running.top_screen import show_screen

    source = HostsHealth(system, hosts)
    source.start()
    try:
        show_screen(source, view)
    finally:
        source.stop()


def merge_health(by_host: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return what several hosts say of their entities as what one says, with their names."""
    merged: dict[str, Any] = {}
    for told in by_host.values():
        merged |= told
    lists = {
        key: [{**each, 'host': host} for host, told in by_host.items() for each in told[key]]
        for key in _LISTS
    }
    return {**merged, **lists}


class HostsHealth:
    """A thread that takes what the hosts send; see `Source` of the screen.

    Attributes:
        error: Always `None`: a host that is lost may come back.
        waits_for: Why there is no answer yet.
    """

    error: Exception | None = None

    def __init__(self, system: str, hosts: Sequence[HostSpec]) -> None:
        self._system, self._hosts = system, hosts
        self.waits_for = f'waiting for the answer of {", ".join(each.name for each in hosts)}'
        self._told: dict[str, Mapping[str, Any]] = {}
        self._problems: dict[str, str] = {}
        self._loop = asyncio.new_event_loop()
        self._work = self._loop.create_task(self._follow_all())
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def document(self) -> dict[str, Any] | None:
        """What the hosts have said last, with what is wrong; `None` before the first answer."""
        told, problems = dict(self._told), dict(self._problems)
        if not (told or problems):
            return None
        own = {'has_cpu': True, 'problems': list(problems.values())}
        return {**own, **merge_health(told), 'name': self._system}

    def start(self) -> None:
        """Connect to the hosts."""
        self._thread.start()

    def stop(self) -> None:
        """End the connections."""
        self._loop.call_soon_threadsafe(self._work.cancel)
        self._thread.join()
        self._loop.close()

    def _run(self) -> None:
        with suppress(asyncio.CancelledError):
            self._loop.run_until_complete(self._work)

    async def _follow_all(self) -> None:
        await asyncio.gather(*map(self._follow, self._hosts))

    async def _follow(self, host: HostSpec) -> None:
        def line(host: HostSpec) -> str:
            return composer_command(self._system, host, 'top', '--each-period')

        while True:
            problems = await follow_all([host], line, self._take)
            self._told.pop(host.name, None)
            text = problems[0] if problems else f'host {host.name}: the part has ended'
            self._problems[host.name] = escape(text.splitlines()[0])
            await asyncio.sleep(_PAUSE_SEC)

    def _take(self, host: HostSpec, line: str) -> None:
        with suppress(ComposerError):
            self._told[host.name] = answer_forms.read_answer(line, answer_forms.TOP)
            self._problems.pop(host.name, None)
