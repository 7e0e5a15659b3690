"""Stopping nodes: nothing new begins, suspended behaviours are ended, `on_stop` runs."""

from __future__ import annotations

import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING

from rclpy.exceptions import InvalidHandle

from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import SystemSpec
    from composer.runtime.nodes.live_node import LiveNode

_POLL_SEC = 0.05
# How much longer than its timeouts a stop may take.
_MARGIN_SEC = 5.0
# To destroy nodes one by one takes time that grows with the square of their number.
_DESTRUCTION_SEC = 0.0005


def limit_stop(spec: SystemSpec, *, ends_process: bool) -> float:
    """Return how long the stop of a system may take, in seconds.

    Args:
        ends_process: Whether the process exits afterwards, and destroys no nodes before.
    """
    last_sec = len(spec.nodes) ** 2 * _DESTRUCTION_SEC
    if ends_process:
        # What behaviours have started and left gets as much time as they themselves.
        last_sec = spec.shutdown_timeout_sec
    return spec.longest_stop_sec + last_sec + _MARGIN_SEC


def stop_nodes(nodes: list[LiveNode], timeout_sec: float) -> bool:
    """Stop all nodes at the same time.

    A node's `on_stop` is called when its behaviours have ended, or after half the time if they
    have not: it switches off what it must even beside a callback that hangs. Services of nodes
    without an `on_stop` answer until all nodes have stopped.

    Returns:
        Whether all behaviours ended in time; the stacks of those that did not are logged.
    """
    begun = monotonic()
    deadline = begun + timeout_sec
    for node in nodes:
        node.behaviour_node.stopping.set()
        node.gate.is_open = False
        _cancel_timers(node)
    stops = [_NodeStop(node, timeout_sec) for node in reversed(nodes) if _has_work_left(node)]
    for stop in stops:
        stop.wait(deadline)
    for node in nodes:
        # What runs may wait for an answer.
        node.running.wait_until_idle(max(begun + timeout_sec / 2 - monotonic(), 0.0))
    for node in nodes:
        node.gate.close()
    ended = [_wait_until_idle(node, deadline) for node in nodes]
    return all(ended) and all(stop.is_over for stop in stops)


def stop_node(node: LiveNode, timeout_sec: float, gives_up: Callable[[], bool]) -> bool:
    """Stop one node, before it is restarted.

    Args:
        gives_up: Whether to stop waiting for it.

    Returns:
        Whether it has stopped. If only `on_stop` has not ended, the gate of the node stays closed;
        if one of its behaviours hangs, nothing has been done to the node.
    """
    node.behaviour_node.stopping.set()
    node.gate.is_open = False
    # What runs may wait for an answer of the node itself.
    _wait_for(node.running.wait_until_idle, timeout_sec / 2, gives_up)
    node.gate.close()
    if not _wait_for(node.running.wait_until_idle, timeout_sec / 2, gives_up):
        node.behaviour_node.stopping.clear()
        node.gate.open()
        return False
    _cancel_timers(node)
    if _has_work_left(node):
        ended = threading.Event()

        def finish() -> None:
            _finish(node, timeout_sec)
            ended.set()

        threading.Thread(target=finish, daemon=True).start()
        _wait_for(ended.wait, timeout_sec, gives_up)
    # It is not stopped twice.
    node.has_begun = False
    node.suspended.clear()
    return node.running.wait_until_idle(0.0)


def _wait_for(
    wait: Callable[[float], bool], timeout_sec: float, gives_up: Callable[[], bool]
) -> bool:
    deadline = monotonic() + timeout_sec
    while not wait(_POLL_SEC):
        if gives_up() or monotonic() > deadline:
            return False
    return True


class _NodeStop:
    """The stop of one node, in a thread of its own if possible.

    It is not where the process has reached its limit of threads; and a new thread may end at once
    if a behaviour has set a tracing function that raises.

    Attributes:
        is_over: Whether the node has stopped.
    """

    def __init__(self, node: LiveNode, timeout_sec: float) -> None:
        self.is_over = False
        self._has_begun = False
        self._node = node
        self._timeout_sec = timeout_sec
        self._thread: threading.Thread | None = None
        with suppress(RuntimeError):
            thread = threading.Thread(target=self._run, daemon=True)
            thread.start()
            self._thread = thread

    def wait(self, deadline: float) -> None:
        """Wait until it is over, or until a time of `time.monotonic`."""
        if self._thread is not None:
            self._thread.join(max(deadline - monotonic(), 0.0))
        if self._thread is None or not (self._has_begun or self._thread.is_alive()):
            self._run()

    def _run(self) -> None:
        self._has_begun = True
        _finish(self._node, self._timeout_sec)
        self.is_over = True


def _has_work_left(node: LiveNode) -> bool:
    has_end = node.spec.on_stop is not None or node.lifecycle is not None
    return bool(node.suspended) or (has_end and node.has_begun)


def _cancel_timers(node: LiveNode) -> None:
    for timer in node.timers():
        with suppress(InvalidHandle):
            # A behaviour may have destroyed it.
            timer.cancel()


def _finish(node: LiveNode, timeout_sec: float) -> None:
    node.running.wait_until_idle(timeout_sec / 2)
    for behaviour in node.suspended:
        behaviour.close(timeout_sec)
    node.gate.serves = False
    node.waits.allow_at_stop()
    if node.lifecycle is not None and node.has_begun:
        node.lifecycle.leave(timeout_sec)
    hook = node.spec.on_stop
    if hook is None or not node.has_begun:
        return
    function = node.bind(hook)
    node.run_to_end(
        node.reported_call(Owner('on_stop'), hook.path, function), timeout_sec=timeout_sec
    )


def _wait_until_idle(node: LiveNode, deadline: float) -> bool:
    if node.running.wait_until_idle(max(deadline - monotonic(), 0.0)):
        return True
    for call in node.running.calls():
        system_logger.error(
            f"node '{node.spec.key}': {call.owner} did not end in time; it is at\n"
            f'{call.format_stack()}'
        )
    return False
