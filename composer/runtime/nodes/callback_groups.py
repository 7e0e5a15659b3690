"""Callback groups with a gate: while it is closed, no callback runs and messages wait.

The gate is closed until all nodes have started, and again when the system stops. Services answer
for longer, so that an `on_start` or `on_stop` can call those of other nodes.
The executor asks a group before it takes a message, so nothing is lost at a closed gate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from weakref import WeakSet, ref

from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.service import Service

from composer.executor.sources.action_classes import is_action_server

if TYPE_CHECKING:
    from composer.runtime.stop_request import StopRequest


class Gate:
    """Whether the behaviours of a node may run.

    Args:
        stop: From the moment of this request on, only those of services and actions may: what a
            stop has ended must not begin anew before the node is stopped.

    Attributes:
        is_open: Whether all of them may: from the start of all nodes to their stop.
        serves: Whether those of services and actions may: from the end of the node's own
            `on_start` to its `on_stop`.
        is_paused: Whether none begins for now, while entities are exchanged; what has begun goes
            on.
        rests: Whether the node has a lifecycle, and is not active.
        may_publish: Whether its publishers publish.
    """

    __slots__ = ('_stop', 'is_open', 'is_paused', 'serves')
    rests = False
    may_publish = True

    def __init__(self, stop: StopRequest) -> None:
        self._stop = stop
        self.is_open = False
        self.serves = False
        self.is_paused = False

    def open(self) -> None:
        """Let all behaviours run."""
        self.serves = True
        self.is_open = True

    def close(self) -> None:
        """Let no behaviour begin from now on."""
        self.is_open = False
        self.serves = False

    def allows(self, entity: Any) -> bool:
        """Return whether the callback of an entity may begin."""
        # Not `allows_events`: this is asked twice for every callback.
        if self.is_paused:
            return False
        return (self.is_open and not self._stop.is_set) or (
            self.serves and (isinstance(entity, Service) or is_action_server(entity))
        )

    def allows_events(self) -> bool:
        """Return whether behaviours of subscriptions, timers and the like may begin."""
        return self.is_open and not self._stop.is_set

    def allows_requests(self) -> bool:
        """Return whether behaviours of services and actions may begin."""
        return self.serves


class LifecycleGate(Gate):
    """The gate of a node with a lifecycle, which rests until the node is active.

    Attributes:
        dropping: The entities whose messages or requests are taken meanwhile, and dropped.
        has_refused: Those of which that was said since the node came to rest.
    """

    def __init__(self, stop: StopRequest) -> None:
        super().__init__(stop)
        self.rests = True
        self.may_publish = False
        self.dropping: WeakSet[Any] = WeakSet()
        self.has_refused: set[str] = set()

    def allows(self, entity: Any) -> bool:
        """See the base class; goals are rejected."""
        if not self.rests:
            return super().allows(entity)
        is_taken = entity in self.dropping or is_action_server(entity)
        return is_taken and super().allows(entity)

    def allows_events(self) -> bool:
        """See the base class."""
        return not self.rests and super().allows_events()

    def allows_requests(self) -> bool:
        """See the base class."""
        return not self.rests and super().allows_requests()

    def drop(self, entity: Any, *, is_dropped: bool) -> None:
        """Let what comes to an entity be dropped while the node rests, or be kept."""
        (self.dropping.add if is_dropped else self.dropping.discard)(entity)


class _TidyGroup(CallbackGroup):
    """Holds an entity until it is gone; the base class would keep a dead reference to it."""

    def add_entity(self, entity: Any) -> None:
        """See the base class."""
        self.entities.add(ref(entity, self.entities.discard))


class EventGroup(_TidyGroup, MutuallyExclusiveCallbackGroup):
    """One callback at a time, of the middleware's events."""


class _GatedGroup(_TidyGroup):
    """Asks its gate first, then the kind of group that it is mixed with.

    Attributes:
        wakes_executor: Tells the executor that it is woken when a gate opens, and need not poll.
    """

    wakes_executor = True

    def __init__(self, gate: Gate) -> None:
        super().__init__()
        self._gate = gate

    def can_execute(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.allows(entity) and bool(super().can_execute(entity))

    def beginning_execution(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.allows(entity) and bool(super().beginning_execution(entity))


class GatedMutuallyExclusiveGroup(_GatedGroup, MutuallyExclusiveCallbackGroup):
    """One callback at a time, and none while the gate is closed."""

    _active_entity: Any

    # These are called for each message, and the lock of the base class is not needed: CPython
    # switches threads only at calls and jumps back.

    def beginning_execution(self, entity: Any) -> bool:
        """See the base class."""
        if not self._gate.allows(entity) or self._active_entity is not None:
            return False
        self._active_entity = entity
        return True

    def ending_execution(self, _entity: Any) -> None:
        """See the base class."""
        self._active_entity = None


class GatedReentrantGroup(_GatedGroup, ReentrantCallbackGroup):
    """Any number of callbacks at a time, and none while the gate is closed."""
