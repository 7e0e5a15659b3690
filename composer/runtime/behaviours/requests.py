"""Requests to servers: of services, of actions, and of the parameters of other nodes."""

from __future__ import annotations

from dataclasses import field
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.task import Future

    from composer.errors import ComposerError
    from composer.runtime.behaviours.waits import WaitNotice, Waits


def _keep(_future: Future) -> None:
    """Let an answer come that nobody waits for."""


@record
class Requests:
    """Sends requests to one server, each as soon as it is there, and waits for the answers.

    Args:
        is_available: Whether the server is there.
        notice: Says that the server is waited for.
        unavailable: Returns the error for a server that is not there after so many seconds.
        unanswered: Returns the error for a request without an answer after so many seconds, and
            since a time of `time.monotonic`.
        forget: Takes the future of a request whose answer is no longer waited for.

    Attributes:
        waiting: The futures of requests whose answers are waited for.
        ended: The error of requests if the client is gone.
    """

    waits: Waits
    is_available: Callable[[], bool]
    notice: WaitNotice
    unavailable: Callable[[float], ComposerError]
    unanswered: Callable[[float, float], ComposerError]
    forget: Callable[[Future], None] = _keep
    waiting: set[Future] = field(default_factory=set)
    ended: list[ComposerError] = field(default_factory=list)

    def end(self, error: ComposerError) -> None:
        """End all requests with an error, as their client goes."""
        self.ended.append(error)
        self.fail(error)

    def fail(self, error: ComposerError) -> None:
        """End all requests that wait for an answer with an error, as their server has gone."""
        for future in list(self.waiting):
            if not future.done():
                self.forget(future)
                future.set_exception(error)

    def send(self, send: Callable[[], Future], timeout_sec: float | None) -> Any:
        """Send a request and return its answer.

        Args:
            send: Sends it.
            timeout_sec: How long to wait for the server and its answer; `None` for no limit.

        Raises:
            ComposerError: There was no server or no answer in time.
            SystemStoppingError: A stop was requested while it waited.
        """
        begun = monotonic()
        if not self.waits.until_true(self._has_server, timeout_sec, self.notice):
            raise self.unavailable(timeout_sec or 0.0)
        future = self._begin(send)
        try:
            if not self.waits.until_done(future, _remaining(timeout_sec, begun)):
                raise self.unanswered(timeout_sec or 0.0, begun)
        finally:
            self.waiting.discard(future)
            if not future.done():
                self.forget(future)
        return future.result()

    async def send_async(self, send: Callable[[], Future], timeout_sec: float | None) -> Any:
        """As `send`, without holding a thread while it waits."""
        begun = monotonic()
        # The server is there, nearly always.
        waits, has_server = self.waits, self._has_server
        if not has_server() and not await waits.until_true_async(
            has_server, timeout_sec, self.notice
        ):
            raise self.unavailable(timeout_sec or 0.0)
        future = self._begin(send)
        try:
            if not await self.waits.until_answered_async(future, _remaining(timeout_sec, begun)):
                raise self.unanswered(timeout_sec or 0.0, begun)
        finally:
            self.waiting.discard(future)
            if not future.done():
                self.forget(future)
        return future.result()

    def _has_server(self) -> bool:
        try:
            is_available = self.is_available()
        except InvalidHandle:
            self._raise_end()
            raise
        self._raise_end()
        return is_available

    def _begin(self, send: Callable[[], Future]) -> Future:
        try:
            future = send()
        except InvalidHandle:
            self._raise_end()
            raise
        self._raise_end()
        self.waiting.add(future)
        if self.ended and not future.done():
            future.set_exception(self.ended[0])
        return future

    def _raise_end(self) -> None:
        """Raise why the client is gone, if it is."""
        if self.ended:
            raise self.ended[0]


def _remaining(timeout_sec: float | None, begun: float) -> float | None:
    if timeout_sec is None:
        return None
    return max(begun + timeout_sec - monotonic(), 0.0)
