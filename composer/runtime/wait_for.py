"""`wait_for`: nodes and processes that start when what they need is there.

The graph is only queried while something waits, at most twenty times a second.
"""

from __future__ import annotations

import threading
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.ament import remaps_actions
from composer.errors import StartError
from composer.names import expand_name, remap_name
from composer.records import record
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.logs import system_logger
from composer.runtime.middleware.ros_graph import RosGraph, create_graph_node, describe_graph

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rclpy.context import Context
    from rclpy.node import Node as RosNode

    from composer.language.specs import ConditionSpec, ProcessSpec
    from composer.processes.external_process import ExternalProcess
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
_AWAITED = {'topic': 'a publisher of', 'action': 'action server'}


@record
class Waiter:
    """A node or process that starts when its conditions hold.

    Attributes:
        label: As in `node 'arm'`.
        resolve: Returns the full name for a condition.
        log: Takes what it waits for.
        start: Starts it; returns when it has started.
    """

    label: str
    conditions: tuple[ConditionSpec, ...]
    resolve: Callable[[ConditionSpec], str]
    log: Callable[[str], Any]
    start: Callable[[], None]


class WaitingStarter:
    """Starts each waiting node and process as soon as its conditions hold.

    Args:
        nodes: The nodes of the system; what is in those that have not started does not count.
        processes: The processes of the system, by their names.
    """

    def __init__(
        self,
        context: Context,
        nodes: Mapping[str, LiveNode],
        processes: Mapping[str, ExternalProcess],
        positions: SourceMap,
    ) -> None:
        self._context = context
        self._nodes = nodes
        self._processes = processes
        self._positions = positions
        self._notices: dict[DataPath, WaitNotice] = {}

    def start_all(self, waiters: Iterable[Waiter], stop: StopRequest) -> None:
        """Start all; a stop request ends the wait.

        Raises:
            StartError: A condition did not hold in time.
        """
        pending = list(waiters)
        if not pending:
            return
        node = create_graph_node(self._context)
        woken = threading.Event()
        begun = monotonic()
        try:
            with stop.waking(woken.set):
                while pending and not stop.is_set:
                    started = self._start_ready(pending, node, begun, stop)
                    pending = [each for each in pending if each not in started]
                    if not started:
                        woken.wait(_POLL_SEC)
        finally:
            node.destroy_node()

    def _start_ready(
        self, pending: list[Waiter], node: RosNode, begun: float, stop: StopRequest
    ) -> list[Waiter]:
        """Start those whose conditions hold, and return them."""
        waited_sec = monotonic() - begun
        graph = RosGraph(node, self._hidden())
        ready = []
        for waiter in pending:
            missing = [each for each in waiter.conditions if not self._holds(waiter, each, graph)]
            if not missing:
                ready.append(waiter)
            for condition in missing:
                if waited_sec >= condition.timeout_sec or self._is_hopeless(condition):
                    raise self._error(waiter, condition, graph)
                self._notice(waiter, condition).log_if_due(begun)
        for waiter in ready:
            if not stop.is_set:
                waiter.start()
        return ready

    def _holds(self, waiter: Waiter, condition: ConditionSpec, graph: RosGraph) -> bool:
        if condition.kind == 'process':
            return self._processes[condition.name].is_ready
        return graph.has(condition.kind, waiter.resolve(condition))

    def _notice(self, waiter: Waiter, condition: ConditionSpec) -> WaitNotice:
        """Return what says that a condition is waited for."""
        if condition.path not in self._notices:
            name = condition.name if condition.kind == 'process' else waiter.resolve(condition)
            what = _AWAITED.get(condition.kind, condition.kind)
            self._notices[condition.path] = WaitNotice(waiter.log, f"{what} '{name}'")
        return self._notices[condition.path]

    def _is_hopeless(self, condition: ConditionSpec) -> bool:
        """Return whether it waits for a process that has ended for good."""
        return condition.kind == 'process' and self._processes[condition.name].is_done

    def _hidden(self) -> frozenset[str]:
        """Return the full names of the nodes that have not started."""
        closed = [node for node in list(self._nodes.values()) if not node.gate.is_open]
        return frozenset(node.full_name for node in closed)

    def _error(self, waiter: Waiter, condition: ConditionSpec, graph: RosGraph) -> StartError:
        span = self._positions.value(condition.path)
        who = f'{waiter.label} ({span.source.name}:{span.line})'
        waited = f'waited {condition.timeout_sec:g} s for the {condition.kind}'
        if condition.kind == 'process':
            process = self._processes[condition.name]
            waited = 'waits for the process' if process.is_done else waited
            return StartError(f"{who} {waited} '{condition.name}': {process.state}")
        name = waiter.resolve(condition)
        late = [
            node.spec.name
            for node in self._nodes.values()
            if node.full_name in graph.hidden and name in graph.names_of(node, condition.kind)
        ]
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
) -> list[Waiter]:
    """Return those of the nodes and processes that have conditions."""
    waiting_processes = [each for each in processes if each.spec.wait_for]
    waiting_nodes = [each for each in nodes if each.spec.wait_for]
    return [
        *(
            Waiter(
                f"process '{process.spec.name}'",
                process.spec.wait_for,
                partial(_resolve_of_process, process.spec),
                partial(_log_of_process, process.spec),
                partial(start_process, process),
            )
            for process in waiting_processes
        ),
        *(
            Waiter(
                f"node '{node.spec.name}'",
                node.spec.wait_for,
                partial(_resolve_of_node, node),
                node.ros.get_logger().info,
                partial(start_node, node),
            )
            for node in waiting_nodes
        ),
    ]


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
