"""Callback groups with a gate: entities of a closed group are not run, their messages wait.

The gate is closed until a node's `on_start` has returned, and closed again when the system stops.
An executor asks a group before it takes an event for it, so nothing is lost at a closed gate.
"""

from __future__ import annotations

from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup


class Gate:
    """Whether the behaviours of a node may run."""

    __slots__ = ('is_open',)

    def __init__(self) -> None:
        self.is_open = False


class GatedMutuallyExclusiveGroup(MutuallyExclusiveCallbackGroup):
    """One callback at a time, and none while the gate is closed."""

    def __init__(self, gate: Gate) -> None:
        super().__init__()
        self._gate = gate

    def can_execute(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.is_open and bool(super().can_execute(entity))

    def beginning_execution(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.is_open and bool(super().beginning_execution(entity))


class GatedReentrantGroup(ReentrantCallbackGroup):
    """Any number of callbacks at a time, and none while the gate is closed."""

    def __init__(self, gate: Gate) -> None:
        super().__init__()
        self._gate = gate

    def can_execute(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.is_open and bool(super().can_execute(entity))

    def beginning_execution(self, entity: Any) -> bool:
        """See the base class."""
        return self._gate.is_open and bool(super().beginning_execution(entity))
