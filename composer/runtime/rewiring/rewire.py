"""Applies a plan to a running system: all of it, or nothing.

What may fail comes first, and is undone in reverse if anything does. What goes, goes last; only
nodes and processes that are recreated end before their successors begin, because two of a name, or
of one device, cannot be.
"""

from __future__ import annotations

from itertools import chain
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from composer.checks.connections import topology
from composer.entity_kinds import ENTITY_KINDS
from composer.errors import StartError
from composer.planning.plan import COMING, GOING, Action
from composer.processes.external_process import ExternalProcess
from composer.runtime.entities.creators import create_entity
from composer.runtime.logs import system_logger
from composer.runtime.nodes.system_handle import never
from composer.runtime.rewiring.node_changes import NodeChange, set_sim_times
from composer.runtime.rewiring.order_of_ends import order_ends
from composer.runtime.rewiring.transaction import Transaction

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from composer.entity_kinds import ChannelKind
    from composer.language.specs import ComponentSpec, ProcessSpec, SystemSpec
    from composer.planning.plan import Plan, Target
    from composer.processes.supervisor import ProcessSupervisor
    from composer.runtime.entities.actions import ActionServer
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.runtime.restart import NodeRestarter
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.start import Starter
    from composer.runtime.stop_request import StopRequest

    # An end, the kind and full name of what it is an end of, and its type.
    _End = tuple[Target, tuple[ChannelKind, str], str]

# All others are of a moment, or final.
_STATES = ('unconfigured', 'inactive', 'active')
_SETTLE_SEC = 0.05
_SETTLE_POLL_SEC = 0.0005
_POLL_SEC = 0.02


class Rewiring:
    """One plan on its way into a running system.

    Args:
        old: What the system runs as.
        new: What it is to run as.
    """

    def __init__(
        self,
        nodes: dict[str, LiveNode],
        processes: ProcessSupervisor,
        handle: SystemHandle,
        starter: Starter,
        restarter: NodeRestarter,
        old: Reading,
        new: Reading,
    ) -> None:
        self._nodes = nodes
        self._processes = processes
        self._handle = handle
        self._starter = starter
        self._restarter = restarter
        self._components = starter.components
        self._old, self._new = old, new
        self._after = {node.full_name: node for node in new.spec.nodes.values()}
        self._transaction = Transaction()
        # Those of nodes with a lifecycle that are recreated.
        self._states: dict[str, str] = {}
        # The processes that ran on demand before they were ended.
        self._running: set[str] = set()
        self._go_on: Callable[[], None] = lambda: None

    def wait_for_goals(
        self, plan: Plan, aborts: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> None:
        """Wait until no goal is in flight of an action that goes; it accepts no more.

        Args:
            aborts: Returns whether the goals are aborted; asked again and again, as the next.
            is_outdated: Returns whether there is a newer edit.

        Raises:
            ComposerError: There is one, and everything is as before.
        """
        servers = list(find_going_actions(self._nodes, plan))
        for server in servers:
            self._transaction.on_undo(server.retire, is_retired=False)
        wait_for_goals(servers, self._handle.stop, aborts, is_outdated)

    def make_way(self, full_names: Iterable[str]) -> None:
        """End nodes that begin elsewhere.

        Raises:
            ComposerError: One of them hangs.
        """
        self._end_nodes(name for name in full_names if name in self._nodes)

    def apply(self, plan: Plan, is_outdated: Callable[[], bool]) -> None:
        """Do all that a plan says; what goes is still there until `commit`.

        Args:
            is_outdated: Returns whether there is a newer edit, for which an `on_start` is left.

        Raises:
            ComposerError: Something failed, and is to be undone.
        """
        self._handle.is_outdated = is_outdated
        try:
            self._read_as(self._new)
            clashing = find_clashing_ends(self._old.spec, self._new.spec)
            at_first = self._are_in_the_way(plan, clashing)
            if at_first:
                self._end_clashing(plan, clashing)
            self._exchange_nodes_and_processes(plan, {each[0] for each in clashing})
            self._go_on = self._pause({each.target[0] for each in plan.operations})
            if not at_first:
                self._end_clashing(plan, clashing)
            self._change_nodes(plan, clashing)
        finally:
            self._handle.is_outdated = never

    def commit(self) -> None:
        """Let go of what was there before."""
        # Both ends would run what comes as soon as behaviours may begin.
        self._transaction.replace()
        # Before nodes are removed, which may take long.
        self._go_on()
        self._transaction.commit()
        self._forget_health()

    def undo(self) -> None:
        """Let everything be as before."""
        self._read_as(self._old)
        self._transaction.undo()
        self._forget_health()

    def _forget_health(self) -> None:
        """Forget the health of behaviours that are gone, or were not to come after all."""
        self._handle.health.keep({name: node.limits for name, node in self._nodes.items()})

    def _read_as(self, reading: Reading) -> None:
        """Let what is created from now on, and what errors tell of places, be of these files."""
        handle, spec = self._handle, reading.spec
        handle.positions = reading.positions
        handle.profiles = spec.qos
        handle.functions = reading.functions
        handle.parameter_files = reading.snapshot.overrides
        handle.without_parameter_services = spec.without_parameter_services

    def _are_in_the_way(self, plan: Plan, clashing: Collection[Target]) -> bool:
        """Return whether nodes that come need what clashes to be gone."""
        names = {target[0] for target in clashing}
        return any(
            each.target[1] == 'nodes' and each.action in COMING and each.target[0] in names
            for each in plan.operations
        )

    def _end_clashing(self, plan: Plan, clashing: Collection[Target]) -> None:
        """End what keeps its topic from having the new type; to undo that, it is created again."""
        for operation in plan.operations:
            full_name, section, name = operation.target
            if operation.target in clashing and operation.action in GOING:
                node = self._nodes[full_name]
                spec = getattr(node.spec, section)[name]
                self._transaction.on_undo(_create_again, node, section, spec)
                node.entities[section].pop(name).destroy()

    def _exchange_nodes_and_processes(self, plan: Plan, clashing: Collection[str]) -> None:
        def targets(section: str, *actions: Action) -> list[str]:
            which = 0 if section == 'nodes' else 2
            return [
                each.target[which]
                for each in plan.operations
                if each.target[1] == section and each.action in actions
            ]

        nodes = self._nodes
        removed = targets('nodes', Action.REMOVE)
        self._end_nodes(targets('nodes', Action.RECREATE))
        self._end_nodes(name for name in removed if name in clashing)
        self._end_processes(targets('processes', Action.RECREATE))
        self._begin(
            targets('nodes', *COMING),
            targets('processes', *COMING),
            list(self._exchange_components(plan)),
        )
        for name, spec in self._new.spec.processes.items():
            process = self._processes.by_name[name]
            before = process.spec.lifecycle
            # Also of one that does as before: errors tell of its places.
            self._transaction.on_undo(process.change, process.spec)
            process.change(spec)
            if process.run is not None and process.spec.lifecycle != before:
                self._transaction.on_commit(self._processes.on_run, process.run)
        for full_name in removed:
            if full_name in nodes:
                self._transaction.on_commit(self._restarter.remove, full_name)
        for name in targets('processes', Action.REMOVE):
            self._transaction.on_commit(self._components.release, self._processes.by_name[name])
            self._transaction.on_commit(self._processes.remove, name)

    def _exchange_components(self, plan: Plan) -> Iterator[tuple[ExternalProcess, ComponentSpec]]:
        """Unload components that are recreated; yield those that are to be loaded."""
        for operation in plan.operations:
            container, section, key = operation.target
            if section != 'components':
                continue
            process = self._processes.by_name[container]
            before, after = process.spec, self._new.spec.processes[container]
            if before is not after:
                self._transaction.on_undo(process.change, before)
                process.change(after)
            if operation.action is Action.REMOVE:
                self._transaction.on_commit(self._components.unload, container, key)
            if operation.action is Action.RECREATE:
                old = self._old.spec.processes[container].components[key]
                self._components.unload(container, key)
                self._transaction.on_undo(self._components.load, process, old)
            if operation.action is Action.CHANGE:
                self._transaction.on_commit(
                    self._components.change, container, after.components[key]
                )
            if operation.action in COMING:
                self._transaction.on_undo(self._components.unload, container, key)
                yield process, after.components[key]

    def _end_nodes(self, names: Iterable[str]) -> None:
        """End nodes that are recreated; to undo that, they begin again with their state."""
        specs = [self._nodes[name].spec for name in names]
        for full_name in chain.from_iterable(order_ends(specs)):
            node = self._nodes[full_name]
            if node.lifecycle is not None:
                self._states[full_name] = node.lifecycle.state
            if not self._restarter.make_way(full_name):
                calls = ', '.join(str(call.owner) for call in node.running.calls())
                message = f"node '{node.spec.key}' cannot be recreated, because it hangs: {calls}"
                raise StartError(message)
            self._transaction.on_undo(self._begin_again, node)

    def _begin_again(self, node: LiveNode) -> None:
        (again,) = self._starter.create([node.spec])
        again.take_over(node)
        self._resume([again])
        self._starter.start_more([again], [])

    def _resume(self, nodes: Iterable[LiveNode]) -> None:
        """Let nodes come to the states that those had in whose place they come."""
        for node in nodes:
            state = self._states.get(node.full_name, '')
            if node.lifecycle is not None and state in _STATES:
                node.lifecycle.start = state

    def _end_processes(self, names: Iterable[str]) -> None:
        for name in names:
            process = self._processes.by_name[name]
            if process.spec.on_demand and process.has_come_to('running'):
                self._running.add(name)
            self._components.release(process)
            self._processes.remove(name)
            self._transaction.on_undo(self._start_processes, [process.spec])

    def _start_processes(self, specs: Iterable[ProcessSpec]) -> None:
        processes = [ExternalProcess(spec) for spec in specs]
        self._processes.by_name.update({each.spec.name: each for each in processes})
        self._starter.start_more([], processes)
        self._start_again(processes)

    def _start_again(self, processes: Iterable[ExternalProcess]) -> None:
        """Start those that start on demand, if they ran before."""
        for process in processes:
            if process.spec.on_demand and process.spec.name in self._running:
                self._starter.start_on_demand(process)

    def _begin(
        self,
        node_names: list[str],
        process_names: list[str],
        components: list[tuple[ExternalProcess, ComponentSpec]],
    ) -> None:
        """Create and start nodes and processes; each waits for what its `wait_for` names."""
        if not (node_names or process_names or components):
            return

        def remove_all() -> None:
            for name in node_names:
                if name in self._nodes:
                    self._restarter.remove(name)
            for name in process_names:
                if name in self._processes.by_name:
                    self._components.release(self._processes.by_name[name])
                    self._processes.remove(name)

        self._transaction.on_undo(remove_all)
        nodes = self._starter.create(self._after[name] for name in node_names)
        self._resume(nodes)
        processes = [ExternalProcess(self._new.spec.processes[name]) for name in process_names]
        self._processes.by_name.update({each.spec.name: each for each in processes})
        self._starter.start_more(nodes, processes, components)
        self._start_again(processes)

    def _change_nodes(self, plan: Plan, clashing: Collection[Target]) -> None:
        """Change what runs on: records, state, parameters and entities."""
        changes = {
            full_name: NodeChange(node, spec, self._old, self._new, clashing, self._transaction)
            for full_name, spec in self._after.items()
            # Those that have just been created have both; others may be declared as before.
            if (node := self._nodes[full_name]).spec is not spec
            or node.functions is not self._new.functions
        }
        for change in changes.values():
            change.replace_record()
        for kind in ENTITY_KINDS:
            for operation in plan.operations:
                if operation.target[1] == kind.section:
                    changes[operation.target[0]].change_entity(operation)
        for operation in plan.operations:
            if operation.target[1] == 'nodes' and operation.action is Action.CHANGE:
                changes[operation.target[0]].change_node(operation)
        set_sim_times(plan, self._nodes, self._transaction)

    def _pause(self, full_names: Collection[str]) -> Callable[[], None]:
        """Let no behaviour of these nodes begin until what is returned is called.

        Those that have just begun may still use what goes, so they are waited for, if they are
        short.
        """
        nodes = [node for name in full_names if (node := self._nodes.get(name))]

        def go_on() -> None:
            for node in nodes:
                node.gate.is_paused = False
            self._handle.executor.wake()

        self._transaction.on_undo(go_on)
        for node in nodes:
            node.gate.is_paused = True
        deadline = monotonic() + _SETTLE_SEC
        while any(map(_is_in_a_call, nodes)) and monotonic() < deadline:
            sleep(_SETTLE_POLL_SEC)
        return go_on


def _create_again(node: LiveNode, section: str, spec: Any) -> None:
    node.entities[section][spec.name] = create_entity(node, section, spec)


def _is_in_a_call(node: LiveNode) -> bool:
    """Return whether a behaviour of a node runs that ends soon: no goal, and no coroutine."""
    return any(call.thread is not None and call.progress is None for call in node.running.calls())


def find_clashing_ends(old: SystemSpec, new: SystemSpec) -> set[Target]:
    """Return the ends, of `old` and of `new`, of what has another type in the other system.

    A process of Fast DDS has one type for each name: an end with the new one can be created only
    when all with the old one are gone.
    """
    before, after = list(_ends(old)), list(_ends(new))

    def differing(ends: list[_End], others: list[_End]) -> set[Target]:
        types = {channel: type_name for _, channel, type_name in others}
        return {
            target
            for target, channel, type_name in ends
            if types.get(channel, type_name) != type_name
        }

    return differing(before, after) | differing(after, before)


def _ends(spec: SystemSpec) -> Iterator[_End]:
    for node in spec.nodes.values():
        for kind, end in node.ends():
            if kind.channel is not None:
                channel = (
                    kind.channel,
                    topology.full_name(node, kind.channel, getattr(end, kind.channel)),
                )
                yield (node.full_name, kind.section, end.name), channel, end.type


def find_going_actions(nodes: Mapping[str, LiveNode], plan: Plan) -> Iterator[ActionServer]:
    """Yield the actions that go, alone or with their nodes."""
    for operation in plan.operations:
        full_name, section, name = operation.target
        node = nodes.get(full_name)
        if node is None or operation.action not in GOING or section not in ('nodes', 'actions'):
            continue
        actions: dict[str, Any] = node.entities['actions']
        yield from actions.values() if section == 'nodes' else [actions[name]]


def wait_for_goals(
    servers: Collection[ActionServer],
    stop: StopRequest,
    aborts: Callable[[], bool],
    is_outdated: Callable[[], bool],
) -> None:
    """Let actions accept no more goals, and wait until none is in flight, or for a stop.

    Args:
        aborts: Returns whether the goals are aborted; asked again and again.
        is_outdated: Returns whether there is a newer edit; asked again and again.

    Raises:
        StartError: There is; the actions accept goals again.
    """
    for server in servers:
        server.retire(is_retired=True)
    was_told = False
    while any(each.has_goals for each in servers) and not stop.is_set:
        if is_outdated():
            for server in servers:
                server.retire(is_retired=False)
            message = 'the files have changed while goals were waited for'
            raise StartError(message)
        if aborts():
            for server in servers:
                server.retire(is_retired=True, aborts=True)
        elif not was_told:
            was_told = True
            system_logger.info('reload: waiting for the goals in flight of actions that go…')
        sleep(_POLL_SEC)
