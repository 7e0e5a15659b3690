"""Requests to servers: of services, of actions, and of the parameters of other nodes."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

from composer.errors import CallError, ComposerError, ServiceFailedError
from composer.records import record
from composer.runtime.tracing.tracer import COROUTINE, tracer

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.task import Future

    from composer.runtime.behaviours.waits import WaitNotice, Waits


class NoResponseError(ComposerError):
    """Raised by a service's callback that has no response, to keep rclpy from sending one.

    Attributes:
        answer: What the call raises that waits for it.
    """

    def __init__(self, answer: CallError) -> None:
        super().__init__(str(answer))
        self.answer = answer


def failed_call(service: str, error: BaseException | None = None) -> CallError:
    """Return what a call raises whose server's callback has raised an error."""
    if isinstance(error, NoResponseError):
        return error.answer
    message = f"'{service}' did not answer: its behaviour raised an error"
    return ServiceFailedError(message, help="the server's log has the traceback")


@record
class RequestFailure:
    """A request over the middleware that gets no response, as ROS has none for errors.

    Attributes:
        service: The full name.
        sequence: The number that its client has given it; others have the same.
        sent_ns: When it was sent, on the clock of the machine; `None` in virtual time.
        error: What the call raises.
    """

    service: str
    sequence: int
    sent_ns: int | None
    error: CallError


def _keep(_future: Future) -> None:
    """Let an answer come that nobody waits for."""


@dataclass(slots=True)
class Requests:
    """Sends requests to one server, each as soon as it is there, and waits for the answers.

    Args:
        is_available: Whether the server is there.
        notice: Says that the server is waited for.
        unavailable: Returns the error for a server that is not there after so many seconds.
        unanswered: Returns the error for a request without an answer after so many seconds.
        lost: Returns the error for a request whose server was killed.
        forget: Takes the future of a request whose answer is no longer waited for.

    Attributes:
        waiting: The futures of requests whose answers are waited for.
        losses: How often a process was killed that may have had the server.
        ended: The error of requests if the client is gone.
        sent: How many requests were sent.
    """

    waits: Waits
    is_available: Callable[[], bool]
    notice: WaitNotice
    unavailable: Callable[[float], ComposerError]
    unanswered: Callable[[float], ComposerError]
    lost: Callable[[], ComposerError]
    forget: Callable[[Future], None] = _keep
    waiting: set[Future] = field(default_factory=set)
    losses: int = 0
    ended: list[ComposerError] = field(default_factory=list)
    sent: int = 0

    def end(self, error: ComposerError) -> None:
        """End all requests with an error, as their client goes."""
        self.ended.append(error)
        self.fail(error)

    def lose(self) -> bool:
        """End all requests if their server was killed; return whether it was."""
        self.losses += 1
        return self._end_if_lost()

    def _end_if_lost(self) -> bool:
        with suppress(InvalidHandle):
            if not self.is_available():
                self.fail(self.lost())
                return True
        return False

    def fail(self, error: ComposerError) -> None:
        """End all requests that wait for an answer with an error."""
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
        begun, losses = monotonic(), self.losses
        if not self.waits.until_true(self._has_server, timeout_sec, self.notice):
            raise self.unavailable(timeout_sec or 0.0)
        with tracer.noting('call', self.waits.node, self.notice.what):
            future = self._begin(send, losses)
            try:
                if not self.waits.until_done(future, _remaining(timeout_sec, begun)):
                    raise self.unanswered(timeout_sec or 0.0)
            finally:
                self.waiting.discard(future)
                if not future.done():
                    self.forget(future)
        return future.result()

    async def send_async(self, send: Callable[[], Future], timeout_sec: float | None) -> Any:
        """As `send`, without holding a thread while it waits."""
        begun, losses = monotonic(), self.losses
        # The server is there, nearly always.
        waits, has_server = self.waits, self._has_server
        if not has_server() and not await waits.until_true_async(
            has_server, timeout_sec, self.notice
        ):
            raise self.unavailable(timeout_sec or 0.0)
        with tracer.noting('call', self.waits.node, self.notice.what, COROUTINE):
            future = self._begin(send, losses)
            try:
                if not await waits.until_answered_async(future, _remaining(timeout_sec, begun)):
                    raise self.unanswered(timeout_sec or 0.0)
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

    def _begin(self, send: Callable[[], Future], losses: int) -> Future:
        try:
            future = send()
        except InvalidHandle:
            self._raise_end()
            raise
        self._raise_end()
        self.sent += 1
        self.waiting.add(future)
        if self.losses != losses:
            # Perhaps while it was sent.
            self._end_if_lost()
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
