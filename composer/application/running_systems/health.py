"""The health that running systems measure: asked for once, or again and again."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from composer.application.running_systems import answer_forms
from composer.application.running_systems.client import STATUS_SEC, Client
from composer.application.running_systems.discovery import Discovery
from composer.errors import ComposerError
from composer.runtime.control import protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.runtime.health.system_state import Outcome

POLL_SEC = 0.1
# What calls cost is known after the second period that somebody looks, as a rule.
_MOST_PERIODS = 3


def read_health(outcome: Outcome) -> dict[str, Any]:
    """Return what a system says of its entities.

    Raises:
        ComposerError: It says that it measures nothing, or what nobody understands.
    """
    if not outcome.succeeded:
        raise ComposerError(outcome.text)
    return answer_forms.read_answer(outcome.text, answer_forms.TOP)


def wait_for_health(ask: Callable[[float], Outcome]) -> dict[str, Any]:
    """Return the health in the first period in which all of it was measured."""
    document = read_health(ask(STATUS_SEC))
    deadline = time.monotonic() + STATUS_SEC + _MOST_PERIODS * document['period_sec']
    while not document['has_cpu'] and time.monotonic() < deadline:
        time.sleep(POLL_SEC)
        document = read_health(ask(STATUS_SEC))
    return document


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
                self.document = read_health(ask(STATUS_SEC))
                pause_sec = max(POLL_SEC, self.document['period_sec'] / 2)
