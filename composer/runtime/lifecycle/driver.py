"""Brings the nodes of external processes to the states that the file wants them in."""

from __future__ import annotations

import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from lifecycle_msgs.msg import State, Transition
from rclpy.exceptions import InvalidHandle

from composer.language.specs import DEFAULT_WAIT_SEC
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.lifecycle.remote_lifecycle import RemoteLifecycle
from composer.runtime.logs import system_logger
from composer.runtime.middleware.ros_graph import create_graph_node

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rclpy.context import Context
    from rclpy.node import Node as RosNode

    from composer.executor import ComposerExecutor
    from composer.language.specs import ComponentSpec, DrivenState
    from composer.processes.external_process import ExternalProcess, ProcessRun
    from composer.processes.supervisor import ProcessSupervisor
    from composer.runtime.stop_request import StopRequest

_POLL_SEC: Final = 0.05
# The next transition on the way to each state, and what it does, by the state that a node is in.
_CONFIGURE = Transition.TRANSITION_CONFIGURE, 'configure'
_WAYS: Final = {
    'inactive': {
        State.PRIMARY_STATE_UNCONFIGURED: _CONFIGURE,
        State.PRIMARY_STATE_ACTIVE: (Transition.TRANSITION_DEACTIVATE, 'deactivate'),
    },
    'active': {
        State.PRIMARY_STATE_UNCONFIGURED: _CONFIGURE,
        State.PRIMARY_STATE_INACTIVE: (Transition.TRANSITION_ACTIVATE, 'activate'),
    },
}


class LifecycleDriver:
    """Drives nodes with a lifecycle that are not the system's own.

    Args:
        executor: Spins the node that asks them.
        processes: Those whose nodes are driven.
    """

    def __init__(
        self,
        context: Context,
        executor: ComposerExecutor,
        stop: StopRequest,
        processes: ProcessSupervisor,
    ) -> None:
        self._context = context
        self._executor = executor
        self._stop = stop
        self._processes = processes
        self._ros: RosNode | None = None
        self._lock = threading.Lock()
        # What drives each process now.
        self._turns: dict[str, object] = {}

    def begin(self, run: ProcessRun) -> None:
        """Drive the nodes of a process that has started, or that an edit has changed."""
        name, turn = run.process.spec.name, object()
        self._turns[name] = turn
        goal = run.process.spec.lifecycle
        if goal is None:
            return

        def has_ended() -> bool:
            is_over = run.code is not None or run.process.is_leaving
            return is_over or self._stop.is_set or self._turns[name] is not turn

        threading.Thread(
            target=self._drive_process, args=(run, goal, has_ended), daemon=True
        ).start()

    def begin_component(
        self, process: ExternalProcess, component: ComponentSpec, is_gone: Callable[[], bool]
    ) -> None:
        """Drive a component that was loaded, or that an edit has changed."""
        if component.lifecycle is None:
            return

        def has_ended() -> bool:
            is_over = process.run is not None and process.run.code is not None
            return is_over or is_gone() or self._stop.is_set

        threading.Thread(
            target=self._drive_component,
            args=(process.run, component, component.lifecycle, has_ended),
            daemon=True,
        ).start()

    def drive(self, name: str, goal: DrivenState, has_ended: Callable[[], bool]) -> str:
        """Bring a node to a state, however long its transitions take.

        Args:
            name: The full name of the node.
            has_ended: Returns whether the node is gone, or nobody wants that any more.

        Returns:
            Why it is not there; empty if it is, or `has_ended`.
        """
        remote = RemoteLifecycle(self._asking_node(), name)
        try:
            return _drive(remote, name, goal, has_ended)
        except InvalidHandle:
            return ''  # The system ends.
        finally:
            remote.destroy()

    def close(self) -> None:
        """Ask no more nodes."""
        if self._ros is not None:
            self._executor.remove_node(self._ros)
            with suppress(InvalidHandle):
                self._ros.destroy_node()

    def _asking_node(self) -> RosNode:
        with self._lock:
            if self._ros is None:
                self._ros = create_graph_node(self._context, '_composer_lifecycles')
                self._executor.add_node(self._ros)
            return self._ros

    def _drive_process(
        self, run: ProcessRun, goal: DrivenState, has_ended: Callable[[], bool]
    ) -> None:
        spec = run.process.spec
        for name in driven_nodes(spec):
            failure = self.drive(name, goal, has_ended)
            if has_ended():
                return
            if failure:
                system_logger.error(f"process '{spec.name}': {failure}")
                self._processes.fail(run)
                return
            system_logger.info(f"process '{spec.name}': node '{name}' is {goal}")

    def _drive_component(
        self,
        run: ProcessRun | None,
        component: ComponentSpec,
        goal: DrivenState,
        has_ended: Callable[[], bool],
    ) -> None:
        failure = self.drive(component.full_name, goal, has_ended)
        if has_ended():
            return
        if not failure:
            system_logger.info(f"component '{component.key}' is {goal}")
            return
        system_logger.error(f"component '{component.key}': {failure}")
        if run is not None:
            self._processes.fail(run)


def driven_nodes(spec: Any) -> Iterable[str]:
    """Return the full names of the nodes of a process, as far as the file tells them."""
    return [each.full_name for each in spec.nodes if each.is_named] or spec.named_nodes


def _drive(
    remote: RemoteLifecycle, name: str, goal: DrivenState, has_ended: Callable[[], bool]
) -> str:
    begun = monotonic()
    notice = WaitNotice(system_logger.info, f"the lifecycle of node '{name}'")
    while not has_ended():
        state = remote.ask_state(has_ended) if remote.is_there else None
        if state is None:
            if monotonic() > begun + DEFAULT_WAIT_SEC:
                return (
                    f"node '{name}' has not told its state for {DEFAULT_WAIT_SEC:g} s: "
                    'it is not there, hangs, or has no lifecycle'
                )
            notice.log_if_due(begun)
        elif state.label == goal:
            return ''
        elif state.id == State.PRIMARY_STATE_FINALIZED:
            return f"node '{name}' is finalized, and cannot be {goal} any more"
        elif (step := _WAYS[goal].get(state.id)) is not None:
            failure = _step(remote, name, step, has_ended)
            if failure:
                return failure
            begun = monotonic()
            continue
        # In a transition of somebody else, or not there.
        _pause(has_ended)
    return ''


def _step(
    remote: RemoteLifecycle, name: str, step: tuple[int, str], has_ended: Callable[[], bool]
) -> str:
    """Have a node make one transition; return what is wrong with the answer."""
    transition, verb = step
    begun = monotonic()
    notice = WaitNotice(system_logger.info, f"node '{name}' to {verb}")
    answer = remote.change(transition, has_ended, lambda: notice.log_if_due(begun))
    if answer is not False:
        return ''
    state = remote.ask_state(has_ended)
    return f"node '{name}' refused to {verb}: it is {state.label if state else 'silent now'}"


def _pause(has_ended: Callable[[], bool]) -> None:
    if not has_ended():
        threading.Event().wait(_POLL_SEC)
