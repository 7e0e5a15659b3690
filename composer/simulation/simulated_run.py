"""The system behind a simulation: the same as any other, without what looks after real ones."""

from __future__ import annotations

import sys
from contextlib import contextmanager, suppress
from copy import deepcopy
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakSet

from rcl_interfaces.msg import Log
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.publisher import Publisher
from rclpy.time import Time

from composer.errors import ComposerError, ExitCode
from composer.names import expand_name
from composer.processes.guardian_client import NoGuardian
from composer.runtime.logs import system_logger
from composer.runtime.messages.ownership import ownership_of
from composer.runtime.system import System
from composer.simulation.topic_faults import TopicFaults
from composer.virtual_time.simulated_executor import SimulatedExecutor

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from composer.language.specs import ConditionSpec, NodeSpec, SystemSpec
    from composer.runtime.messages.local_delivery import LocalPublisher, Tap
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import Observe
    from composer.runtime.rewiring.reading import Reading
    from composer.virtual_time.simulated_threads import SimulatedThreads

_INFO: Final = 20
# Of their publishers, no message is an event.
_UNTOLD: Final = frozenset({'/parameter_events', '/rosout'})
_LEVELS = {10: 'debug', 20: 'info', 30: 'warn', 40: 'error', 50: 'fatal'}


class SimulatedRun(System):
    """A system whose executor runs in virtual time.

    There is no guardian, nothing looks for behaviours that hang, for topics that do not match or
    for commands from outside: all of that is in real time.

    Args:
        observe: Takes what happens.
        on_created: Called when there are all nodes, and none of their behaviours has been called.
        begins_source: Returns whether a source of a node runs as it is.

    Attributes:
        faults: What happens to messages on their way.
    """

    def __init__(
        self,
        reading: Reading,
        threads: SimulatedThreads,
        observe: Observe,
        on_created: Callable[[], None],
        begins_source: Callable[[str, str], bool],
    ) -> None:
        self._threads = threads
        self.faults = TopicFaults(threads)
        self._ended: dict[str, LiveNode] = {}
        self._on_created = on_created
        super().__init__(reading, NoGuardian(owns_process=False))
        nothing: Any = _Nothing()
        self._control = self._hang_watcher = self._graph_watcher = nothing
        self._parameter_services = nothing
        self._handle.observe = observe
        self._handle.begins_source = begins_source
        self._tapped: WeakSet[Publisher] = WeakSet()
        self._handle.topics.tap(self._tap)

    def _create_executor(self, **calls: Any) -> SimulatedExecutor:
        return SimulatedExecutor(self._threads, self._context, self._reading.spec.threads, **calls)

    def _create_nodes(self) -> None:
        super()._create_nodes()
        self._on_created()

    def _tap(self, publisher: LocalPublisher) -> Tap:
        observe: Any = self._handle.observe
        node = publisher.node.get_fully_qualified_name()
        topic, copy = publisher.ros.topic_name, ownership_of(publisher.ros.msg_type).copy
        self._tapped.add(publisher.ros)

        deliver = partial(publisher.deliver, is_held=False)

        def tap(message: Any) -> bool:
            observe('message', node, topic, copy(message))
            return self.faults.take(topic, partial(copy, message), deliver)

        return tap

    @contextmanager
    def observed_publishers(self) -> Iterator[None]:
        """Observe also what behaviours publish with publishers of rclpy, meanwhile."""
        publish: Any = Publisher.publish

        def observed(ros: Publisher, message: Any) -> None:
            if self._threads.mine() is not None and ros not in self._tapped:
                self._tell_of(ros, message)
                again, send = partial(deepcopy, message), partial(publish, ros)
                if self.faults.take(ros.topic_name, again, send):
                    return
            publish(ros, message)

        Publisher.publish = observed
        try:
            yield
        finally:
            Publisher.publish = publish

    def _tell_of(self, ros: Publisher, message: Any) -> None:
        for node in self._nodes.values():
            if ros in node.ros.publishers and type(message) is ros.msg_type:
                name = ros.topic_name
                if name not in _UNTOLD:
                    self._handle.tell('message', node.full_name, name, message)

    def end_node(self, full_name: str, *, is_killed: bool) -> None:
        """End a node.

        Args:
            is_killed: Whether it ends as with its process: nothing of it is called any more.

        Raises:
            ComposerError: It does not run.
        """
        with self._restarter.lock:
            node = self._nodes.get(full_name)
            if node is None:
                message = f"node '{full_name}' does not run"
                raise ComposerError(message)
            if is_killed:
                self._restarter.drop(full_name)
            else:
                self._restarter.remove(full_name)
            self._ended[full_name] = node

    def begin_node(self, full_name: str) -> None:
        """Start a node again that has ended.

        Raises:
            ComposerError: It runs, or it cannot start.
        """
        with self._restarter.lock:
            if full_name not in self._ended:
                message = f"node '{full_name}' runs"
                raise ComposerError(message)
            self._restarter.build(self._ended.pop(full_name))

    @property
    def nodes(self) -> Mapping[str, LiveNode]:
        """Its nodes, by their full names."""
        return self._nodes

    @property
    def exit_code(self) -> int | None:
        """The exit code, once a stop is requested or made."""
        has_code = self.stop_requested or self.state.is_stopping
        return self._stop_request.code if has_code else None


def without_processes(spec: SystemSpec, more: Mapping[str, NodeSpec]) -> SystemSpec:
    """Return a system without its external processes, and with more nodes, which come first."""
    own = {node.full_name for node in spec.nodes.values()}
    nodes = {key: _without_waits(node, own) for key, node in spec.nodes.items()}
    return replace(spec, nodes={**more, **nodes}, processes={})


def _without_waits(node: NodeSpec, own: Collection[str]) -> NodeSpec:
    """Return a node that waits for no process, and for no node that one would bring."""

    def may_hold(condition: ConditionSpec) -> bool:
        if condition.kind == 'node':
            return expand_name(condition.name, node.name, node.namespace) in own
        return condition.kind != 'process'

    conditions = tuple(filter(may_hold, node.wait_for))
    return replace(node, wait_for=conditions) if conditions != node.wait_for else node


class ObservedLog:
    """What all loggers write: it is observed, and published on `/rosout`, in virtual time.

    Nothing of it goes to rcutils, which stamps it in real time.

    Args:
        observe: Is told of each line, with the full name of the node that it belongs to.
        now_ns: Returns the virtual time, in ns since 1970.
        is_shown: Whether the lines are printed, too.

    Attributes:
        publisher: Of `/rosout`; `None` before there is one.
    """

    def __init__(self, observe: Observe, now_ns: Callable[[], int], *, is_shown: bool) -> None:
        self._observe = observe
        self._now_ns = now_ns
        self._is_shown = is_shown
        self.publisher: Publisher | None = None

    @contextmanager
    def replacing(self) -> Iterator[None]:
        """Take the lines meanwhile."""
        log = _rclpy.rclpy_logging_rcutils_log
        _rclpy.rclpy_logging_rcutils_log = self._take
        try:
            yield
        finally:
            _rclpy.rclpy_logging_rcutils_log = log

    def _take(self, severity: Any, name: str, text: str, *place: Any) -> None:
        is_of_system = name == system_logger.name
        if is_of_system and int(severity) <= _INFO:
            return  # It counts the node of the scenario.
        level = _LEVELS.get(int(severity), str(severity))
        node = '' if is_of_system or not name else f'/{name.replace(".", "/")}'
        self._observe('log', node, level, str(text))
        stamp = Time(nanoseconds=self._now_ns())
        if self._is_shown:
            seconds, rest_ns = stamp.seconds_nanoseconds()
            line = f'[{level.upper()}] [{seconds}.{rest_ns:09}] [{name}]: {text}'
            sys.stderr.write(f'{line}\n')
            sys.stderr.flush()
        if self.publisher is None or not node:
            return
        function, file, number = (*place, '', '', 0)[:3]
        message = Log(stamp=stamp.to_msg(), level=int(severity), name=name, msg=str(text))
        message.file, message.function, message.line = str(file), str(function), int(number)
        # It goes with the nodes at the end.
        with suppress(InvalidHandle):
            self.publisher.publish(message)


class _Nothing:
    """Does nothing, whatever it is asked for."""

    def __getattr__(self, _name: str) -> Any:
        return lambda *_arguments, **_options: ExitCode.DONE
