"""`composer top`: the health of each entity of a running system, as a table that changes."""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import click

from composer.cli.running import answer_forms
from composer.cli.running.client import STATUS_SEC, Client
from composer.cli.running.discovery import Discovery
from composer.cli.running.top_table import (
    describe_worst,
    find_worst,
    render_entities,
    select_entities,
)
from composer.errors import ComposerError, ExitCode
from composer.runtime.control import protocol
from composer.terminal import is_output_unread

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.cli.running.top_table import View
    from composer.runtime.health.system_state import Outcome

_POLL_SEC = 0.1
# What calls cost is known after the second period that somebody looks, as a rule.
_MOST_PERIODS = 3


def top(
    name: str | None, view: View, *, once: bool, format_name: str, each_period: bool = False
) -> int:
    """Show the health of each entity; return the exit code.

    Args:
        name: Of the system; `None` for the only one.
        view: What to show first.
        once: Whether to print it once. So it is where there is no screen.
        format_name: `text` or `json`; JSON is printed once.
        each_period: Whether to print a line of JSON in each period, until nobody reads it.

    Raises:
        ComposerError: There is no such system, it measures nothing, or it ended.
    """
    if not (each_period or once or format_name == 'json') and has_screen():
        return _watch(name, view)
    with Client() as client:
        system = Discovery(client).find(name)
        with client.asking(system, protocol.TOP) as ask:
            if each_period:
                return _print_each(ask)
            document = _wait_for_all(ask)
            print_health(document, view, format_name)
            return ExitCode.DONE


def has_screen() -> bool:
    """Return whether there is a terminal that can draw."""
    from composer.cli.running.top_screen import can_draw

    return sys.stdout.isatty() and sys.stdin.isatty() and can_draw()


def print_health(document: dict[str, Any], view: View, format_name: str) -> None:
    """Print what a system says of its entities."""
    entities = select_entities(document['entities'], view)
    if format_name == 'json':
        found = {'kept_waiting_by': find_worst(document), 'entities': entities}
        click.echo(json.dumps({**document, **found}, indent=2))
    else:
        lines = map(describe_worst, find_worst(document))
        click.echo('\n'.join([*render_entities(entities), *lines]))


def _read(outcome: Outcome) -> dict[str, Any]:
    if not outcome.succeeded:
        raise ComposerError(outcome.text)
    return answer_forms.read_answer(outcome.text, answer_forms.TOP)


def _print_each(ask: Callable[[float], Outcome]) -> int:
    printed = None
    while not is_output_unread():
        document = _read(ask(STATUS_SEC))
        if document['period'] != printed:
            click.echo(json.dumps(document))
            printed = document['period']
        time.sleep(max(_POLL_SEC, document['period_sec'] / 2))
    return ExitCode.DONE


def _wait_for_all(ask: Callable[[float], Outcome]) -> dict[str, Any]:
    """Return the health in the first period in which all of it was measured."""
    document = _read(ask(STATUS_SEC))
    deadline = time.monotonic() + STATUS_SEC + _MOST_PERIODS * document['period_sec']
    while not document['has_cpu'] and time.monotonic() < deadline:
        time.sleep(_POLL_SEC)
        document = _read(ask(STATUS_SEC))
    return document


def _watch(name: str | None, view: View) -> int:
    from composer.cli.running.top_screen import show_screen

    poller = Poller(name)
    poller.start()
    try:
        show_screen(poller, view)
    finally:
        error = poller.error
        poller.stop()
    if error is not None:
        raise error
    return ExitCode.DONE


class Poller:
    """A thread that finds a system and asks it again and again, so the screen does not wait.

    Args:
        name: Of the system; `None` for the only one.

    Attributes:
        waits_for: Why there is no answer yet.
        document: The last answer; `None` before the first.
        error: Why there are no more answers.
    """

    def __init__(self, name: str | None) -> None:
        self._name = name
        self.waits_for = 'starting ROS'
        self.document: dict[str, Any] | None = None
        self.error: Exception | None = None
        self._client: Client | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def stop(self) -> None:
        """Ask no more."""
        self._ended.set()
        if self._client is not None:
            self._client.interrupt()
        self._thread.join()

    def _run(self) -> None:
        try:
            with Client() as self._client:
                self._ask_all(self._client)
        except Exception as error:  # noqa: BLE001 - it is raised when the screen has gone
            self.error = error

    def _ask_all(self, client: Client) -> None:
        what = 'the system' if self._name is None else f"system '{self._name}'"
        self.waits_for = f'looking for {what} (ROS_DOMAIN_ID {client.domain_id})'
        if self._ended.is_set():
            return
        system = Discovery(client).find(self._name)
        self.waits_for = f"waiting for the answer of system '{system.name}'"
        with client.asking(system, protocol.TOP) as ask:
            pause_sec = 0.0
            while not self._ended.wait(pause_sec):
                self.document = _read(ask(STATUS_SEC))
                pause_sec = max(_POLL_SEC, self.document['period_sec'] / 2)
