"""The start of nodes and external processes.

The entities of a node are created, `on_start` runs, then behaviours may be called.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rclpy.exceptions import InvalidHandle

from composer.errors import StartError
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.behaviours.tracebacks import represent
from composer.runtime.entities.creators import create_entities
from composer.runtime.lifecycle.transitions import Lifecycle
from composer.runtime.logs import set_level
from composer.runtime.nodes.callback_groups import LifecycleGate
from composer.runtime.nodes.live_node import LiveNode, create_live_node
from composer.runtime.wait_for import Waiter, WaitingStarter, list_waiters

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from composer.language.specs import BehaviourSpec, ComponentSpec, NodeSpec
    from composer.processes.external_process import ExternalProcess
    from composer.processes.supervisor import ProcessSupervisor
    from composer.runtime.external.components import Components
    from composer.runtime.nodes.live_entity import NodeLifecycle
    from composer.runtime.nodes.system_handle import SystemHandle

_POLL_SEC = 0.05


class Starter:
    """Creates nodes, and starts nodes and processes: at the start of a system and later.

    Args:
        nodes: Takes each node that is created, by its full name.

    Attributes:
        components: Loads the components of containers.
    """

    def __init__(
        self,
        nodes: dict[str, LiveNode],
        processes: ProcessSupervisor,
        components: Components,
        system: SystemHandle,
    ) -> None:
        self._nodes = nodes
        self.components = components
        self._processes = processes
        self._system = system
        self.awaited: dict[str, str] = {}

    def create(self, specs: Iterable[NodeSpec]) -> list[LiveNode]:
        """Create nodes with all their entities; none of their behaviours is called yet.

        Raises:
            StartError: One of them, or of their entities, cannot be created.
        """
        nodes = [self._create_node(spec) for spec in specs]
        create_entities(nodes)
        return nodes

    def start_prompt(
        self, nodes: Iterable[LiveNode], processes: Iterable[ExternalProcess]
    ) -> list[LiveNode]:
        """Start what waits for nothing; return these nodes, which are still to be opened.

        Raises:
            StartError: One could not start.
        """
        for process in processes:
            spec = process.spec
            if not (spec.on_demand or spec.starts_late or self._system.stop.is_set):
                self._processes.start(process)
        prompt = [node for node in nodes if not node.spec.starts_late]
        for node in prompt:
            self.run_on_start(node)
        return prompt

    def list_waiters(
        self,
        nodes: Iterable[LiveNode],
        processes: Collection[ExternalProcess],
        components: Iterable[tuple[ExternalProcess, ComponentSpec]] = (),
    ) -> list[Waiter]:
        """Return what waits for something before it starts.

        Args:
            components: Those to load into containers that run.
        """
        own = [each for each in processes if not each.spec.on_demand]
        waiters = self._list_late(nodes, own)
        waiters += self.components.waiters(processes)
        return waiters + [self.components.waiter(*each) for each in components]

    def start_waiting(self, waiters: Iterable[Waiter]) -> None:
        """Start what waits, each as soon as what it waits for is there.

        Raises:
            StartError: Something was not there in time.
        """
        self._waiting_starter().start_all(waiters, self._system.stop, self._system.is_outdated)

    def start_on_demand(self, process: ExternalProcess) -> None:
        """Start a process now that another one has ended, once its conditions hold.

        Raises:
            StartError: It could not start.
        """
        waiters = self._list_late([], [process])
        if waiters:
            self._waiting_starter().start_all(waiters, self._system.stop)
        else:
            self._processes.start(process)
        self.components.reload(process)

    def start_more(
        self,
        nodes: Collection[LiveNode],
        processes: Collection[ExternalProcess],
        components: Iterable[tuple[ExternalProcess, ComponentSpec]] = (),
    ) -> None:
        """Start nodes and processes beside those that run.

        Args:
            components: See `list_waiters`.

        Raises:
            StartError: One could not start.
        """
        for node in nodes:
            self._system.executor.add_node(node.ros)
            node.serve_at_once()
        self.open(self.start_prompt(nodes, processes))
        self.start_waiting(self.list_waiters(nodes, processes, components))
        for node in nodes:
            node.ros.start_parameter_services()

    def run_on_start(self, node: LiveNode) -> None:
        """Call a node's `on_start`, and wait for its end or for a stop of the system.

        Raises:
            StartError: It raised.
        """
        hook = node.spec.on_start
        if self._system.stop.is_set:
            return
        node.has_begun = True
        if hook is not None:
            self._call_on_start(node, hook)
        if node.lifecycle is not None:
            self._bring_up(node, node.lifecycle)
        node.gate.serves = not self._system.stop.is_set
        self._system.executor.wake()

    def _call_on_start(self, node: LiveNode, hook: BehaviourSpec) -> None:
        failures: list[BaseException] = []
        function = node.bind(hook)
        call = node.reported_call(Owner('on_start'), hook.path, function, failures.append)
        _, ended = node.begin(call)
        self._wait(node, ended, 'on_start')
        if failures:
            # `on_stop` is not called for it.
            node.has_begun = False
            message = f"node '{node.spec.key}': on_start raised {represent(failures[0])}"
            raise StartError(message) from failures[0]

    def _bring_up(self, node: LiveNode, lifecycle: NodeLifecycle) -> None:
        """Bring a node to the state in which it starts.

        Raises:
            StartError: It did not get there.
        """
        ended = threading.Event()
        task = self._system.executor.create_task(lifecycle.require, lifecycle.start)
        task.add_done_callback(lambda _task: ended.set())
        self._wait(node, ended, 'transitions')
        if task.done() and (error := task.exception()):
            raise error

    def _wait(self, node: LiveNode, ended: threading.Event, what: str) -> None:
        while not ended.wait(_POLL_SEC) and not self._system.stop.is_set:
            if self._system.is_outdated():
                message = f"node '{node.spec.key}': the files have changed during its {what}"
                raise StartError(message)

    def open(self, nodes: Iterable[LiveNode]) -> None:
        """Let the behaviours of nodes that have started be called."""
        for node in nodes:
            node.gate.open()
            for timer in () if node.gate.rests else node.timers():
                with suppress(InvalidHandle):
                    # `on_start` may have destroyed it.
                    timer.reset()
        self._system.executor.wake()

    def _waiting_starter(self) -> WaitingStarter:
        return WaitingStarter(
            self._system.context,
            self._system.executor,
            self._nodes,
            self._system.elsewhere,
            self._system.positions,
            self.awaited,
        )

    def _list_late(
        self, nodes: Iterable[LiveNode], processes: Iterable[ExternalProcess]
    ) -> list[Waiter]:
        # A reload may have removed or replaced a node that waits.
        return list_waiters(
            nodes,
            processes,
            self._start_late,
            self._processes.start,
            lambda node: self._nodes.get(node.spec.full_name) is node,
        )

    def _start_late(self, node: LiveNode) -> None:
        self.run_on_start(node)
        if not self._system.stop.is_set:
            self.open([node])

    def _create_node(self, spec: NodeSpec) -> LiveNode:
        if spec.log_level or self._system.log_levels:
            set_level(spec, self._system.log_levels)
        try:
            node = create_live_node(spec, self._system)
        except Exception as error:
            message = f"node '{spec.key}' cannot be created: {error}"
            raise StartError(message) from error
        if isinstance(node.gate, LifecycleGate):
            node.lifecycle = Lifecycle(node, node.gate)
        self._nodes[spec.full_name] = node
        return node
