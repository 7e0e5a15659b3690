"""Asks a container to load and unload components, over `composition_interfaces`."""

from __future__ import annotations

import threading
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.client import Client
    from rclpy.node import Node as RosNode
    from rclpy.task import Future

# The first two services of a container, as rclcpp_components names them.
LOAD_SERVICE = '_container/load_node'
_POLL_SEC = 0.05
# A container that has just begun, or begins anew, may miss a question.
_QUESTION_SEC = 0.5


class ContainerError(ComposerError):
    """A container did not do what it was asked, or is gone."""


class ContainerClient:
    """The services of one container.

    Args:
        full_name: Of the container's node.
        gives_up: Returns why an answer is waited for in vain; an empty string if it is not.
    """

    def __init__(self, node: RosNode, full_name: str, gives_up: Callable[[], str]) -> None:
        from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode

        self.full_name = full_name
        self._node = node
        self._gives_up = gives_up
        # Requests to load that were given up: nobody can stop the container from obeying them.
        self._given_up: list[Future] = []
        # Whether its components have services for the levels of their loggers; `None` if unknown.
        self.has_logger_services: bool | None = None
        # In this order: a container that answers the last question knows the clients before it.
        self._load = node.create_client(LoadNode, f'{full_name}/{LOAD_SERVICE}')
        self._unload = node.create_client(UnloadNode, f'{full_name}/_container/unload_node')
        self._list = node.create_client(ListNodes, f'{full_name}/_container/list_nodes')

    @property
    def servers(self) -> frozenset[bytes]:
        """What identifies the containers of this name that are in the graph, also dead ones."""
        ends = self._node.get_subscriptions_info_by_topic(
            f'rq{self.full_name}/{LOAD_SERVICE}Request', no_mangle=True
        )
        return frozenset(bytes(each.endpoint_gid) for each in ends)

    def list_nodes(self, timeout_sec: float | None) -> dict[int, str]:
        """Return the full names of the nodes in the container, by their unique ids.

        Args:
            timeout_sec: `None` for no limit.

        Raises:
            ContainerError: It does not answer in time, or is gone.
        """
        begun = monotonic()
        notice = WaitNotice(system_logger.info, f"an answer of the container '{self.full_name}'")
        while timeout_sec is None or monotonic() < begun + timeout_sec:
            answer = self._ask(self._list, self._list.srv_type.Request(), _QUESTION_SEC, notice)
            if answer is not None:
                return dict(zip(answer.unique_ids, answer.full_node_names, strict=True))
        message = f"the container '{self.full_name}' does not answer"
        raise ContainerError(message)

    def load(self, request: Any, what: str) -> tuple[int, str]:
        """Load a component; return its unique id and full name.

        Args:
            request: Of `composition_interfaces/srv/LoadNode`.
            what: The component in words.

        Raises:
            ContainerError: The container could not load it, is gone, or there is a newer edit.
                What it loads all the same is unloaded when it answers.
        """
        self.settle()
        notice = WaitNotice(system_logger.info, f"the container '{self.full_name}' to load {what}")
        answer = self._ask(self._load, request, None, notice)
        if not answer.success:
            raise ContainerError(answer.error_message or 'it gave no reason')
        return answer.unique_id, answer.full_node_name

    def settle(self, timeout_sec: float | None = None) -> None:
        """Wait until what was loaded by requests that were given up is unloaded.

        Raises:
            ContainerError: The container is gone, or there is a newer edit.
        """
        begun = monotonic()
        what = f"the container '{self.full_name}' to answer a request that is not wanted any more"
        notice = WaitNotice(system_logger.info, what)
        while self._given_up and (timeout_sec is None or monotonic() < begun + timeout_sec):
            if reason := self._gives_up():
                raise ContainerError(reason)
            notice.log_if_due(begun)
            sleep(_POLL_SEC)

    def forget(self) -> None:
        """Forget what was asked of a container that has ended."""
        self._given_up.clear()

    def _give_up(self, loading: Future) -> None:
        self._given_up.append(loading)

        def is_over(_future: Future) -> None:
            if loading in self._given_up:
                self._given_up.remove(loading)

        def unload(_future: Future) -> None:
            answer = loading.result()
            if answer is None or not answer.success:
                is_over(loading)
                return
            request = self._unload.srv_type.Request(unique_id=answer.unique_id)
            self._unload.call_async(request).add_done_callback(is_over)

        loading.add_done_callback(unload)

    def unload(self, unique_id: int, timeout_sec: float) -> None:
        """Unload a component.

        Raises:
            ContainerError: The container could not, does not answer in time, or is gone.
        """
        request = self._unload.srv_type.Request(unique_id=unique_id)
        answer = self._ask(self._unload, request, timeout_sec, None)
        if answer is None:
            message = f"the container '{self.full_name}' does not answer"
            raise ContainerError(message)
        if not answer.success:
            raise ContainerError(answer.error_message or 'it gave no reason')

    def destroy(self) -> None:
        """Remove the clients from the graph."""
        for client in (self._load, self._unload, self._list):
            self._node.destroy_client(client)

    def _ask(
        self, client: Client, request: Any, timeout_sec: float | None, notice: WaitNotice | None
    ) -> Any:
        """Return the answer; `None` if there is none in time."""
        begun = monotonic()
        answered = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _future: answered.set())
        while not answered.wait(_POLL_SEC):
            if timeout_sec is not None and monotonic() > begun + timeout_sec:
                client.remove_pending_request(future)
                return None
            if reason := self._gives_up():
                if client is self._load:
                    self._give_up(future)
                else:
                    client.remove_pending_request(future)
                raise ContainerError(reason)
            if notice is not None:
                notice.log_if_due(begun)
        return future.result()
