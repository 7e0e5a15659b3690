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
    from rclpy.node import Node as RosNode
    from rclpy.task import Future

# An answer that has not come by then is lost: the node may have died.
_LOST_SEC: Final = 2.0


class RemoteLifecycle:
    """Asks a node for its state, and to change it.

    Args:
        ros: The node that asks; some executor spins it.
        name: The full name of the node that is asked.
    """

    def __init__(self, ros: RosNode, name: str) -> None:
        group = ReentrantCallbackGroup()
        self._ros = ros
        self._states = ros.create_client(GetState, f'{name}/get_state', callback_group=group)
        self._changes = ros.create_client(
            ChangeState, f'{name}/change_state', callback_group=group
        )
        self._known = ''
        self._pending: Future | None = None
        self._asked = 0.0

    def look(self) -> str:
        """Return the state when it was last asked for, '' if not known; and ask for it again."""
        pending = self._pending
        if pending is not None and pending.done():
            self._known, pending = pending.result().current_state.label, None
        if pending is not None and monotonic() > self._asked + _LOST_SEC:
            self._states.remove_pending_request(pending)
            pending = None
        if pending is None and self._states.service_is_ready():
            self._asked = monotonic()
            pending = self._states.call_async(GetState.Request())
        elif not self._states.service_is_ready():
            self._known = ''
        self._pending = pending
        return self._known

    @property
    def is_there(self) -> bool:
        """Whether its services are."""
        return bool(self._states.service_is_ready() and self._changes.service_is_ready())

    def ask_state(self, ended: threading.Event) -> Any:
        """Return its `lifecycle_msgs/msg/State`; `None` if there is no answer.

        Args:
            ended: If this is set nobody waits any more.
        """
        response = self._ask(self._states, GetState.Request(), ended, _LOST_SEC)
        return response and response.current_state

    def change(self, transition: int, ended: threading.Event) -> bool | None:
        """Have it make a transition, however long that takes.

        Returns:
            Whether it did; `None` if there is no answer, as it has gone.
        """
        request = ChangeState.Request()
        request.transition.id = transition
        response = self._ask(self._changes, request, ended, None)
        return response and bool(response.success)

    def destroy(self) -> None:
        """Ask no more."""
        for client in (self._states, self._changes):
            with suppress(InvalidHandle):
                self._ros.destroy_client(client)

    def _ask(
        self, client: Any, request: Any, ended: threading.Event, timeout_sec: float | None
    ) -> Any:
        future = client.call_async(request)
        answered = threading.Event()
        future.add_done_callback(lambda _future: answered.set())
        begun = monotonic()
        while not (answered.wait(_POLL_SEC) or ended.is_set()):
            waited_sec = monotonic() - begun
            is_gone = not client.service_is_ready() and waited_sec > _LOST_SEC
            if is_gone or (timeout_sec is not None and waited_sec > timeout_sec):
                client.remove_pending_request(future)
                return None
        return future.result() if future.done() else None


_POLL_SEC = 0.02
