"""The lifecycle of a node outside of the system, asked over its services."""

from __future__ import annotations

import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node as RosNode
    from rclpy.task import Future

# An answer that has not come by then is lost: the node may have died.
_LOST_SEC: Final = 2.0
_POLL_SEC: Final = 0.02


def _nothing() -> None:
    """Do nothing."""


class RemoteLifecycle:
    """Asks a node for its state, and to change it.

    Args:
        ros: The node that asks; some executor spins it.
        name: The full name of the node that is asked.
    """

    def __init__(self, ros: RosNode, name: str) -> None:
        group = ReentrantCallbackGroup()
        self._ros = ros
        # Made first: the node finds clients in their order, and one that it has not found waits in
        # vain for its answer. A transition is asked for once a state has been told.
        self._changes = ros.create_client(
            ChangeState, f'{name}/change_state', callback_group=group
        )
        self._states = ros.create_client(GetState, f'{name}/get_state', callback_group=group)
        self._known = ''
        self._pending: Future | None = None
        self._asked = 0.0

    def look(self) -> str:
        """Return the state when it was last asked for, '' if not known; and ask for it again."""
        if not self._states.service_is_ready():
            self._known = ''
            return ''
        if self._pending is not None and self._pending.done():
            self._known, self._pending = self._pending.result().current_state.label, None
        if self._pending is not None and monotonic() > self._asked + _LOST_SEC:
            self._states.remove_pending_request(self._pending)
            self._pending = None
        if self._pending is None:
            self._asked = monotonic()
            self._pending = self._states.call_async(GetState.Request())
        return self._known

    @property
    def is_there(self) -> bool:
        """Whether its services are."""
        return bool(self._states.service_is_ready() and self._changes.service_is_ready())

    def ask_state(self, has_ended: Callable[[], bool]) -> Any:
        """Return its `lifecycle_msgs/msg/State`; `None` if there is no answer.

        Args:
            has_ended: Returns whether nobody waits any more.
        """
        response = self._ask(self._states, GetState.Request(), has_ended, _LOST_SEC)
        return response and response.current_state

    def change(
        self,
        transition: int,
        has_ended: Callable[[], bool],
        still_waits: Callable[[], None] = _nothing,
    ) -> bool | None:
        """Have it make a transition, however long that takes.

        Args:
            transition: Its identifier in `lifecycle_msgs/msg/Transition`.
            still_waits: Called again and again until there is an answer.

        Returns:
            Whether it did; `None` if there is no answer, as it has gone.
        """
        request = ChangeState.Request()
        request.transition.id = transition
        response = self._ask(self._changes, request, has_ended, None, still_waits)
        return response and bool(response.success)

    def destroy(self) -> None:
        """Ask no more."""
        for client in (self._states, self._changes):
            with suppress(InvalidHandle):
                self._ros.destroy_client(client)

    def _ask(
        self,
        client: Any,
        request: Any,
        has_ended: Callable[[], bool],
        timeout_sec: float | None,
        still_waits: Callable[[], None] = _nothing,
    ) -> Any:
        future = client.call_async(request)
        answered = threading.Event()
        future.add_done_callback(lambda _future: answered.set())
        begun = monotonic()
        while not answered.wait(_POLL_SEC):
            waited_sec = monotonic() - begun
            is_gone = not client.service_is_ready()
            is_late = timeout_sec is not None and waited_sec > timeout_sec
            if has_ended() or is_gone or is_late:
                client.remove_pending_request(future)
                return None
            still_waits()
        return future.result()
