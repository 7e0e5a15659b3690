"""Requests to services of the same system are handed over, and so are the responses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.task import Future

from composer.runtime.messages.ownership import ownership_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.service import Service as RosService

    from composer.executor import ComposerExecutor
    from composer.executor.sources.inbox import Inbox


class LocalService:
    """A service of the system.

    Args:
        inbox: Takes requests.
    """

    def __init__(self, ros: RosService, inbox: Inbox) -> None:
        self.ros = ros
        self._inbox = inbox
        self._requests = ownership_of(ros.srv_type.Request)
        self._responses = ownership_of(ros.srv_type.Response)

    def call(self, request: Any, *, is_held: bool) -> Future:
        """Hand a request over, and return the future of its response.

        Args:
            is_held: Whether somebody else refers to the request.
        """
        future = Future()
        taken = self._requests.take(request, is_held=is_held)
        self._inbox.put(_Request(taken, future, self._responses.copy))
        return future


class _Request:
    """A request that was handed over."""

    __slots__ = ('_copy', '_future', 'message')

    def __init__(self, message: Any, future: Future, copy: Callable[[Any], Any]) -> None:
        self.message = message
        self._future = future
        self._copy = copy

    def respond(self, response: Any) -> None:
        """Take the response, which the server may keep."""
        self._future.set_result(self._copy(response))


class LocalServices:
    """The services of one system, by their names in the graph and their types."""

    def __init__(self, executor: ComposerExecutor) -> None:
        self._executor = executor
        self._services: dict[tuple[str, type], LocalService] = {}

    def add(self, node: Any, ros: RosService, name: str, depth: int | None) -> LocalService:
        """Take in a service of `node`."""
        service = LocalService(ros, self._executor.open_inbox(node, ros, depth))
        self._services[name, ros.srv_type] = service
        return service

    def remove(self, service: LocalService) -> None:
        """Forget a service."""
        for key, known in list(self._services.items()):
            if known is service:
                del self._services[key]

    def find(self, name: str, service_class: type) -> LocalService | None:
        """Return the service of a name and a type, if it is the system's own."""
        return self._services.get((name, service_class))
