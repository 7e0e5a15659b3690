"""`wait_for` and `delay`: nodes and processes that start when what they need is there.

The graph is only queried while something waits, at most twenty times a second.
"""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, get_args

from composer.ament import remaps_actions
from composer.errors import StartError
from composer.language.specs import LifecycleState
from composer.names import expand_name, remap_name
from composer.records import record
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.lifecycle.remote_lifecycle import RemoteLifecycle
from composer.runtime.logs import system_logger
from composer.runtime.middleware.ros_graph import RosGraph, create_graph_node, describe_graph
from composer.runtime.nodes.system_handle import never

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rclpy.context import Context
    from rclpy.node import Node as RosNode

    from composer.executor import ComposerExecutor
    from composer.language.specs import ConditionSpec, ProcessSpec
    from composer.processes.external_process import ExternalProcess
    from composer.runtime.elsewhere import Elsewhere
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.stop_request import StopRequest
    from composer.yaml_text.positions import DataPath, SourceMap

_POLL_SEC = 0.05
_REASONS = {
    'topic': 'nothing publishes it',
    'service': 'nothing serves it',
    'action': 'nothing serves it',
    'node': 'there is no such node',
}
# What is waited for, where that is not called as the key is.
_AWAITED = {'topic': "a publisher of '{}'", 'action': "action server '{}'"}
_AWAITED_STATES = {
    'running': "process '{}' to run",
    'ended': "the end of process '{}'",
    'succeeded': "process '{}' to succeed",
    **{each: f"node '{{}}' to be {each}" for each in get_args(LifecycleState)},
}


@record
class Waiter:
    """A node or process that starts when its conditions hold.

    Attributes:
        label: As in `node 'arm'`.
        key: The full name of the node or component; the label of a process.
        delay_sec: Time between the moment when they hold and its start.
        resolve: Returns the full name for a condition.
        log: Takes what it waits for.
        start: Starts it; returns when it has started.
        is_wanted: Whether it is still to start.
    """

    label: str
    key: str
    conditions: tuple[ConditionSpec, ...]
    delay_sec: float
    resolve: Callable[[ConditionSpec], str]
    log: Callable[[str], Any]
    start: Callable[[], None]
    is_wanted: Callable[[], bool]


def find_hidden(nodes: Mapping[str, LiveNode]) -> frozenset[str]:
    """Return the full names of those nodes that have not started."""
    closed = [node for node in list(nodes.values()) if not node.gate.is_open]
    return frozenset(node.full_name for node in closed)


class WaitingStarter:
    """Starts each waiting node and process as soon as its conditions hold.

    Args:
        executor: Spins the node that asks other nodes for their states.
        nodes: The nodes of the system; what is in those that have not started does not count.
        elsewhere: What of the system is not in these nodes.
        awaited: Has what each waits for, by its key, for as long as it waits.
    """

    def __init__(
        self,
        context: Context,
        executor: ComposerExecutor,
        nodes: Mapping[str, LiveNode],
        elsewhere: Elsewhere,
        positions: SourceMap,
        awaited: dict[str, str],
    ) -> None:
        self._context = context
        self._executor = executor
        self._remotes: dict[str, RemoteLifecycle] = {}
        self._nodes = nodes
        self._elsewhere = elsewhere
        self._positions = positions
        self._awaited = awaited
        self._notices: dict[DataPath | int, WaitNotice] = {}
        # When the conditions of a waiter held first.
        self._held: dict[int, float] = {}

    def start_all(
        self,
        waiters: Iterable[Waiter],
        stop: StopRequest,
        is_outdated: Callable[[], bool] = never,
    ) -> None:
        """Start all; a stop request ends the wait.

        Args:
            is_outdated: Returns whether there is a newer edit.

        Raises:
            StartError: A condition did not hold in time, or there is a newer edit.
        """
        pending = list(waiters)
        if not pending:
            return
        node = create_graph_node(self._context)
        # The handler of a signal wakes it, in this thread: no lock of `threading` may be held.
        woken: SimpleQueue[None] = SimpleQueue()
        begun = monotonic()
        try:
            with stop.waking(partial(woken.put, None)):
                while pending and not stop.is_set:
                    if is_outdated():
                        message = f'{pending[0].label}: the files have changed while it waited'
                        raise StartError(message)
                    started = self._start_ready(pending, node, begun, stop)
                    for waiter in [*pending]:
                        if waiter in started or not waiter.is_wanted():
                            pending.remove(waiter)
                            self._awaited.pop(waiter.key, None)
                    if not started:
                        with suppress(Empty):
                            woken.get(timeout=_POLL_SEC)
        finally:
            for waiter in pending:
                self._awaited.pop(waiter.key, None)
            self._executor.remove_node(node)
            self._remotes.clear()
            node.destroy_node()

    def _start_ready(
        self, pending: list[Waiter], node: RosNode, begun: float, stop: StopRequest
    ) -> list[Waiter]:
        """Start those whose conditions hold, and return them."""
        now = monotonic()
        waited_sec = now - begun
        graph = RosGraph(node, self._hidden())
        ready = []
        for waiter in pending:
            conditions = () if id(waiter) in self._held else waiter.conditions
            missing = [each for each in conditions if not self._holds(waiter, each, graph, node)]
            if not missing:
                held = self._held.setdefault(id(waiter), now)
                if now >= held + waiter.delay_sec:
                    ready.append(waiter)
                else:
                    notice = self._delay_notice(waiter)
                    self._awaited[waiter.key] = notice.what
                    notice.log_if_due(held)
            for condition in missing:
                if waited_sec >= condition.timeout_sec or self._is_hopeless(condition):
                    raise self._error(waiter, condition, graph)
                notice = self._notice(waiter, condition)
                self._awaited[waiter.key] = notice.what
                # At the same time: what has waited long enough has no notice first.
                notice.log_if_due(begun, now)
        for waiter in ready:
            if not stop.is_set:
                waiter.start()
        return ready

    def _holds(
        self, waiter: Waiter, condition: ConditionSpec, graph: RosGraph, node: RosNode
    ) -> bool:
        if condition.kind == 'process':
            state: Any = condition.state
            return self._elsewhere.find_process(condition.name).has_come_to(state)
        name = waiter.resolve(condition)
        if condition.state is None:
            return graph.has(condition.kind, name)
        return name not in graph.hidden and self._state_of(name, node) == condition.state

    def _state_of(self, name: str, node: RosNode) -> str:
        """Return the state of a node with a lifecycle; '' if it is not known."""
        own = self._nodes.get(name)
        if own is not None:
            return own.lifecycle.state if own.lifecycle else ''
        if name not in self._remotes:
            self._remotes[name] = RemoteLifecycle(node, name)
            self._executor.add_node(node)
        return self._remotes[name].look()

    def _notice(self, waiter: Waiter, condition: ConditionSpec) -> WaitNotice:
        """Return what says that a condition is waited for."""
        if condition.path not in self._notices:
            name = condition.name if condition.kind == 'process' else waiter.resolve(condition)
            what = _AWAITED.get(condition.kind, f"{condition.kind} '{{}}'")
            what = _AWAITED_STATES.get(condition.state or '', what).format(name)
            self._notices[condition.path] = WaitNotice(waiter.log, what)
        return self._notices[condition.path]

    def _delay_notice(self, waiter: Waiter) -> WaitNotice:
        if id(waiter) not in self._notices:
            what = f'its delay of {waiter.delay_sec:g} s'
            self._notices[id(waiter)] = WaitNotice(waiter.log, what)
        return self._notices[id(waiter)]

    def _is_hopeless(self, condition: ConditionSpec) -> bool:
        """Return whether it waits for a process that has ended for good."""
        if condition.kind != 'process':
            return False
        return self._elsewhere.find_process(condition.name).is_done

    def _hidden(self) -> frozenset[str]:
        """Return the full names of the nodes that have not started."""
        return find_hidden(self._nodes) | self._elsewhere.find_hidden()

    def _error(self, waiter: Waiter, condition: ConditionSpec, graph: RosGraph) -> StartError:
        span = self._positions.value(condition.path)
        who = f'{waiter.label} ({span.source.name}:{span.line})'
        waited = f'waited {condition.timeout_sec:g} s for the {condition.kind}'
        if condition.kind == 'process':
            process = self._elsewhere.find_process(condition.name)
            waited = 'waits for the process' if process.is_done else waited
            what = {'ended': ' to end', 'succeeded': ' to succeed'}.get(condition.state or '', '')
            message = f"{who} {waited} '{condition.name}'{what}: {process.state}"
            is_lost = process.is_done and condition.state
            advice = 'that can never be, so the start fails' if is_lost else None
            return StartError(message, help=advice)
        name = waiter.resolve(condition)
        late = [
            node.spec.name
            for node in self._nodes.values()
            if node.full_name in graph.hidden and name in graph.names_of(node, condition.kind)
        ]
        if condition.state and graph.has('node', name):
            own, remote = self._nodes.get(name), self._remotes.get(name)
            state = own.lifecycle.state if own and own.lifecycle else remote and remote.look()
            is_it = f'it is {state}' if state else 'it tells no state, and may have no lifecycle'
            return StartError(f"{who} {waited} '{name}' to be {condition.state}: {is_it}")
        message = f"{who} {waited} '{name}': {_REASONS[condition.kind]}"
        if late:
            nodes = ' and '.join(f"'{each}'" for each in late)
            verb = 'has' if len(late) == 1 else 'have'
            message += f' but {nodes} of this system, which {verb} not started'
        return StartError(message, help=describe_graph(condition.kind, name, graph))


def list_waiters(
    nodes: Iterable[LiveNode],
    processes: Iterable[ExternalProcess],
    start_node: Callable[[LiveNode], None],
    start_process: Callable[[ExternalProcess], None],
    is_wanted: Callable[[LiveNode], bool],
) -> list[Waiter]:
    """Return those of the nodes and processes that have conditions or a delay.

    Args:
        is_wanted: Whether a node is still to start.
    """
    waiting_processes = [each for each in processes if each.spec.starts_late]
    waiting_nodes = [each for each in nodes if each.spec.starts_late]
    return [
        *(
            Waiter(
                (label := f"process '{process.spec.name}'"),
                label,
                process.spec.wait_for,
                process.spec.delay_sec,
                partial(_resolve_of_process, process.spec),
                partial(_log_of_process, process.spec),
                partial(start_process, process),
                partial(_is_process_wanted, process),
            )
            for process in waiting_processes
        ),
        *(
            Waiter(
                f"node '{node.spec.name}'",
                node.full_name,
                node.spec.wait_for,
                node.spec.delay_sec,
                partial(_resolve_of_node, node),
                node.ros.get_logger().info,
                partial(start_node, node),
                partial(is_wanted, node),
            )
            for node in waiting_nodes
        ),
    ]


def _is_process_wanted(process: ExternalProcess) -> bool:
    return not process.is_leaving


def _resolve_of_node(node: LiveNode, condition: ConditionSpec) -> str:
    """Return the full name for a condition of a node, resolved as in the node itself."""
    if condition.kind == 'topic':
        return str(node.ros.resolve_topic_name(condition.name))
    if condition.kind == 'service':
        return str(node.ros.resolve_service_name(condition.name))
    return node.ros.resolve_action_name(condition.name)


def _log_of_process(spec: ProcessSpec, text: str) -> None:
    system_logger.info(f"process '{spec.name}': {text}")


def _resolve_of_process(spec: ProcessSpec, condition: ConditionSpec) -> str:
    name, namespace = spec.node_name or spec.name, spec.namespace or '/'
    full = expand_name(condition.name, name, namespace)
    if condition.kind == 'action' and remaps_actions():
        return remap_name(full, spec.remap, name, namespace, 'rostopic')
    if condition.kind not in ('topic', 'service'):
        return full
    return remap_name(full, spec.remap, name, namespace, f'ros{condition.kind}')
