"""Behaviours for what the middleware tells: feedback and results of goals, and QoS events."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

from composer.runtime.behaviours.running_calls import Owner

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import BehaviourSpec
    from composer.runtime.behaviours.calls import BehaviourCall
    from composer.runtime.nodes.live_entity import BehaviourOptions
    from composer.runtime.nodes.live_node import LiveNode

# By the keys of the language, what rclpy calls the events.
_EVENTS = {
    'on_deadline_missed': 'deadline',
    'on_liveliness_lost': 'liveliness',
    'on_liveliness_changed': 'liveliness',
    'on_incompatible_qos': 'incompatible_qos',
    'on_message_lost': 'message_lost',
    'on_matched': 'matched',
}


def events_of(spec: Any) -> dict[str, BehaviourSpec]:
    """Return the behaviours for QoS events of a publisher or subscription, by their keys."""
    return {key: each for key in _EVENTS if (each := getattr(spec, key, None)) is not None}


class EventBehaviours:
    """Calls a behaviour for each item, in order, as one of the node's own callbacks.

    What the middleware brings comes in a thread of its own; a guard condition takes it over into
    the node's callback group, so that the behaviours never run beside the node's others. There is
    one for all of them: of two, the one triggered last may come first.

    Args:
        noun: The kind of their entity.
        name: Its name.
    """

    def __init__(self, node: LiveNode, noun: str, name: str) -> None:
        self._node = node
        self._noun, self._name = noun, name
        self._items: deque[tuple[str, Any]] = deque()
        self._calls: dict[str, BehaviourCall] = {}
        self._guard: Any = None

    def change(
        self, behaviours: Mapping[str, BehaviourSpec], options: BehaviourOptions | None = None
    ) -> None:
        """Call these behaviours from the next item on, by their keys."""
        node = self._node
        self._calls = {
            key: node.call(
                Owner(self._noun, self._name, key),
                behaviour.path,
                node.bind(behaviour),
                options=options,
                may_begin=node.gate.allows_events,
            )
            for key, behaviour in behaviours.items()
        }
        if not self._calls:
            self.destroy()
            return
        are_async = any(call.is_async for call in self._calls.values())
        drain = self._drain_async if are_async else self._drain
        if self._guard is None:
            self._guard = node.ros.create_guard_condition(drain, callback_group=node.group(None))
        self._guard.callback = drain
        if self._items:
            self._guard.trigger()

    def destroy(self) -> None:
        """Call no behaviour any more."""
        if self._guard is not None:
            self._node.ros.destroy_guard_condition(self._guard)
            self._guard = None

    def has(self, key: str) -> bool:
        """Return whether there is a behaviour under a key."""
        return key in self._calls

    def put(self, key: str, item: Any) -> None:
        """Let the behaviour under a key be called with an item."""
        self._items.append((key, item))
        # A server of the same system may be faster than the end of its client.
        with suppress(AttributeError, InvalidHandle):
            self._guard.trigger()

    def callbacks(self, keys: Mapping[str, Any]) -> dict[str, Callable[[Any], None]]:
        """Return what takes the QoS events of these keys, by rclpy's names of them."""
        return {_EVENTS[key]: partial(self.put, key) for key in keys}

    def _drain(self) -> None:
        while self._items:
            key, item = self._items.popleft()
            if call := self._calls.get(key):
                call.run(item)

    async def _drain_async(self) -> None:
        while self._items:
            key, item = self._items.popleft()
            if call := self._calls.get(key):
                result = call.run(item)
                if call.is_async:
                    await result
