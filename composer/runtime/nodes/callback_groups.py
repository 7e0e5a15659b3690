"""Callback groups with a gate: entities of a closed group are not run, their messages wait.

The gate is closed until all nodes have started, and closed again when the system stops. Services
answer for longer, so that an `on_start` or `on_stop` can call those of other nodes.
An executor asks a group before it takes an event for it, so nothing is lost at a closed gate.
"""

from __future__ import annotations

from typing import Any

from rclpy.action import ActionServer
from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.service import Service


class Gate:
    """Whether the behaviours of a node may run.

    Attributes:
        is_open: All of them: when all nodes have started, until a stop is requested.
        serves: Those of services and actions: from the end of the node's own `on_start` until
            its `on_stop`.
    """

    __slots__ = ('is_open', 'serves')

    def __init__(self) -> None:
        self.is_open = False
        self.serves = False

    def open(self) -> None:
        """Let all behaviours run."""
        self.serves = True
        self.is_open = True

    def close(self) -> None:
        """Let no behaviour begin."""
        self.is_open = False
        self.serves = False

    def lets(self, entity: Any) -> bool:
        """Return whether the callback of an entity may begin."""
        return self.is_open or (self.serves and isinstance(entity, (Service, ActionServer)))

    def lets_events(self) -> bool:
        """Return whether behaviours that answer nobody may begin."""
        return self.is_open

    def lets_requests(self) -> bool:
        """Return whether behaviours that answer requests may begin."""
        return self.serves


class _GatedGroup(CallbackGroup):
    """Asks its gate before it asks the kind of group that it is mixed with.

    Attributes:
        wakes_executor: Tells the executor that it is woken when a gate opens, and need not ask.
    """

    wakes_executor = True

    def __init__(self, gate: Gate) -> None:
        super().__init__()
        self._gate = gate

    def can_execute(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.lets(entity) and bool(super().can_execute(entity))

    def beginning_execution(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.lets(entity) and bool(super().beginning_execution(entity))


class GatedMutuallyExclusiveGroup(_GatedGroup, MutuallyExclusiveCallbackGroup):
    """One callback at a time, and none while the gate is closed."""


class GatedReentrantGroup(_GatedGroup, ReentrantCallbackGroup):
    """Any number of callbacks at a time, and none while the gate is closed."""
