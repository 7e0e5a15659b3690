"""Applies a plan to a running system: all of it, or nothing.

What may fail comes first, and is undone in reverse if anything does. What goes, goes last; only
nodes and processes that are recreated end before their successors begin, because two of a name, or
of one device, cannot be.
"""

from __future__ import annotations

import copy
from contextlib import suppress
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.parameter import Parameter

from composer.entity_kinds import ENTITY_KINDS
from composer.errors import StartError
from composer.planning.plan import Action
from composer.processes.external_process import ExternalProcess
from composer.runtime.entities.creators import create_entity
from composer.runtime.logs import set_level, system_logger
from composer.runtime.nodes.system_handle import never
from composer.runtime.rewiring.clashes import find_clashing_ends
from composer.runtime.rewiring.parameter_changes import ParameterChange

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from composer.language.specs import NodeSpec
    from composer.planning.plan import Operation, Plan, Target
    from composer.processes.supervisor import ProcessSupervisor
    from composer.runtime.entities.actions import ActionServer
    from composer.runtime.nodes.live_node import LiveEntity, LiveNode
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.runtime.restart import NodeRestarter
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.start import NodeStarter
    from composer.runtime.stop_request import StopRequest

_POLL_SEC = 0.02
_SETTLE_SEC = 0.05
_GONE_SEC = 1.0
_SETTLE_POLL_SEC = 0.0005
_GOING = (Action.RECREATE, Action.REMOVE)
_COMING = (Action.RECREATE, Action.ADD)


class Rewiring:
    """One plan on its way into a running system.

    Args:
        start: Starts nodes and processes that were created.
        old: What the system runs as.
        new: What it is to run as.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - the parts of a system
        self,
        nodes: dict[str, LiveNode],
        processes: ProcessSupervisor,
        handle: SystemHandle,
        starter: NodeStarter,
        restarter: NodeRestarter,
        start: Callable[[Collection[LiveNode], Collection[ExternalProcess]], None],
        old: Reading,
        new: Reading,
    ) -> None:
        self._nodes = nodes
        self._processes = processes
        self._handle = handle
        self._starter = starter
        self._restarter = restarter
        self._start = start
        self._old, self._new = old, new
        self._before = {node.full_name: node for node in old.spec.nodes.values()}
        self._after = {node.full_name: node for node in new.spec.nodes.values()}
        self._clashing: Collection[Target] = ()
        self._undo: list[Callable[[], object]] = []
        self._finish: list[Callable[[], object]] = []

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
        servers = list(self._going_actions(plan))
        for server in servers:
            self._undo.append(partial(server.retire, is_retired=False))
        wait_for_goals(servers, self._handle.stop, aborts, is_outdated)

    def apply(self, plan: Plan, is_outdated: Callable[[], bool]) -> None:
        """Do all that a plan says.

        Args:
            is_outdated: Returns whether there is a newer edit, for which an `on_start` is left.

        Raises:
            ComposerError: Something failed, and everything is as before.
        """
        self._handle.is_outdated = is_outdated
        try:
            self._read_as(self._new)
            self._clashing = clashing = find_clashing_ends(self._old.spec, self._new.spec)
            at_first = self._are_in_the_way(plan, clashing)
            if at_first:
                self._end_clashing(plan, clashing)
            self._exchange_nodes_and_processes(plan, {each[0] for each in clashing})
            self._pause({each.target[0] for each in plan.operations})
            if not at_first:
                self._end_clashing(plan, clashing)
            self._change_nodes(plan)
            self._switch_clocks(plan)
        except BaseException:
            self._undo_all()
            raise
        finally:
            self._handle.is_outdated = never
        for finish in self._finish:
            finish()
        self._forget_health()

    def _going_actions(self, plan: Plan) -> Iterable[ActionServer]:
        for operation in plan.operations:
            full_name, section, name = operation.target
            node = self._nodes.get(full_name)
            if (
                node is None
                or operation.action not in _GOING
                or section not in ('nodes', 'actions')
            ):
                continue
            actions: dict[str, Any] = node.entities['actions']
            yield from actions.values() if section == 'nodes' else [actions[name]]

    def _undo_all(self) -> None:
        self._handle.is_outdated = never
        self._read_as(self._old)
        for undo in reversed(self._undo):
            try:
                undo()
            except Exception as error:  # noqa: BLE001 - the rest must be undone
                system_logger.error(f'reload: something could not be undone: {error}')
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

    def _create(self, target: Target, node: LiveNode, spec: Any) -> LiveEntity:
        """Create an entity; one whose topic gets another type when the old ends have gone."""
        deadline = monotonic() + (_GONE_SEC if target in self._clashing else 0.0)
        while True:
            try:
                return create_entity(node, target[1], spec)
            except StartError:
                # The middleware may still deliver to one of them.
                if monotonic() > deadline:
                    raise
            sleep(_POLL_SEC)

    def _are_in_the_way(self, plan: Plan, clashing: Collection[Target]) -> bool:
        """Return whether nodes that come need what clashes to be gone."""
        names = {target[0] for target in clashing}
        return any(
            each.target[1] == 'nodes' and each.action in _COMING and each.target[0] in names
            for each in plan.operations
        )

    def _end_clashing(self, plan: Plan, clashing: Collection[Target]) -> None:
        """End what keeps its topic from having the new type; to undo that, it is created again."""
        for operation in plan.operations:
            full_name, section, name = operation.target
            if operation.target in clashing and operation.action in _GOING:
                node, spec = (
                    self._nodes[full_name],
                    getattr(self._before[full_name], section)[name],
                )
                self._undo.append(partial(_create_again, node, section, spec))
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
        self._begin(targets('nodes', *_COMING), targets('processes', *_COMING))
        for name in targets('processes', Action.CHANGE):
            process = self._processes.by_name[name]
            self._undo.append(partial(process.change, process.spec))
            process.change(self._new.spec.processes[name])
        for full_name in removed:
            if full_name in nodes:
                self._finish.append(partial(self._restarter.remove, full_name))
        for name in targets('processes', Action.REMOVE):
            self._finish.append(partial(self._processes.remove, name))

    def _end_nodes(self, names: Iterable[str]) -> None:
        """End nodes that are recreated; to undo that, they begin again with their state."""
        for full_name in names:
            node = self._nodes[full_name]
            if not self._restarter.make_way(full_name):
                calls = ', '.join(str(call.owner) for call in node.running.calls())
                message = f"node '{node.spec.key}' cannot be recreated, because it hangs: {calls}"
                raise StartError(message)
            self._undo.append(partial(self._begin_again, node))

    def _begin_again(self, node: LiveNode) -> None:
        (again,) = self._starter.create([node.spec])
        again.take_over(node)
        self._start([again], [])

    def _end_processes(self, names: Iterable[str]) -> None:
        for name in names:
            spec = self._processes.by_name[name].spec
            self._processes.remove(name)
            self._undo.append(partial(self._start_process, spec))

    def _start_process(self, spec: Any) -> None:
        self._processes.by_name[spec.name] = process = ExternalProcess(spec)
        self._start([], [process])

    def _begin(self, node_names: list[str], process_names: list[str]) -> None:
        """Create and start nodes and processes; each waits for what its `wait_for` names."""
        if not (node_names or process_names):
            return

        def remove_all() -> None:
            for name in node_names:
                if name in self._nodes:
                    self._restarter.remove(name)
            for name in process_names:
                if name in self._processes.by_name:
                    self._processes.remove(name)

        self._undo.append(remove_all)
        nodes = self._starter.create(self._after[name] for name in node_names)
        processes = [ExternalProcess(self._new.spec.processes[name]) for name in process_names]
        self._processes.by_name.update({each.spec.name: each for each in processes})
        self._start(nodes, processes)

    def _change_nodes(self, plan: Plan) -> None:
        """Change what runs on: records, state, parameters and entities."""
        for full_name, spec in self._after.items():
            node = self._nodes[full_name]
            if node.spec is not spec:
                self._replace_record(node, spec)
        for kind in ENTITY_KINDS:
            for operation in plan.operations:
                if operation.target[1] == kind.section:
                    self._change_entity(operation)
        for operation in plan.operations:
            if operation.target[1] == 'nodes' and operation.action is Action.CHANGE:
                self._change_node(self._nodes[operation.target[0]], operation)

    def _pause(self, full_names: Collection[str]) -> None:
        """Let no behaviour of these nodes begin while their entities are exchanged.

        Those that have just begun may still use what goes, so they are waited for, if they are
        short.
        """
        nodes = [node for name in full_names if (node := self._nodes.get(name))]

        def go_on() -> None:
            for node in nodes:
                node.gate.is_paused = False
            self._handle.executor.wake()

        self._undo.append(go_on)
        # Before nodes are removed, which may take long.
        self._finish.insert(0, go_on)
        for node in nodes:
            node.gate.is_paused = True
        deadline = monotonic() + _SETTLE_SEC
        while any(map(_is_in_a_call, nodes)) and monotonic() < deadline:
            sleep(_SETTLE_POLL_SEC)

    def _replace_record(self, node: LiveNode, spec: NodeSpec) -> None:
        """Let a node have another record, and the state that this declares."""
        before, state = node.spec, vars(node.behaviour_node.state)
        gone = {
            key: state.pop(key) for key in before.state if key not in spec.state and key in state
        }
        come = {
            key: copy.deepcopy(value)
            for key, value in spec.state.items()
            if key not in before.state and key not in state
        }
        state.update(come)
        node.spec, node.functions = spec, self._new.functions
        self._follow_files(node, self._new)

        def put_back() -> None:
            node.spec, node.functions = before, self._old.functions
            self._follow_files(node, self._old)
            for key in come:
                state.pop(key, None)
            state.update(gone)

        self._undo.append(put_back)

    @staticmethod
    def _follow_files(node: LiveNode, reading: Reading) -> None:
        entries = reading.snapshot.overrides.get(node.full_name, {})
        if entries or node.ros.from_files:
            node.ros.follow_files(entries)

    def _change_node(self, node: LiveNode, operation: Operation) -> None:
        keys = {each.top_key for each in operation.changes}
        old = self._before[node.full_name]
        if 'log_level' in keys:
            self._undo.append(partial(set_level, old, self._handle.log_levels))
            set_level(node.spec, self._handle.log_levels)
        if keys & {'on_parameters', 'on_error', 'warn_after'} and node.parameters:
            self._undo.append(partial(node.parameters.ask, old.on_parameters))
            node.parameters.ask(node.spec.on_parameters)
        if keys & {'on_error', 'warn_after'}:
            # Their behaviours have no such keys of their own.
            for name, spec in node.spec.action_clients.items():
                client = node.entities['action_clients'][name]
                before = old.action_clients.get(name, spec)
                self._undo.append(partial(node.change, 'action client', before, client))
                node.change('action client', spec, client)

    def _switch_clocks(self, plan: Plan) -> None:
        """Change `use_sim_time`, last of all.

        rclpy has the subscription to `/clock` come and go with it: one that goes cannot be brought
        back as it was if anything else fails. So those that go, go after those that come.
        """
        values = {}
        for operation in plan.operations:
            node = self._nodes.get(operation.target[0])
            keys = {each.key for each in operation.changes}
            if node and operation.action is Action.CHANGE and 'use_sim_time' in keys:
                given = node.ros.find_override('use_sim_time')
                values[node.full_name] = node.spec.use_sim_time if given is None else given
        for full_name in sorted(values, key=values.__getitem__, reverse=True):
            node = self._nodes[full_name]
            before = node.ros.get_parameter('use_sim_time').value
            _set_sim_time(node, value=values[full_name])
            self._undo.append(partial(_set_sim_time, node, value=before))

    def _change_entity(self, operation: Operation) -> None:
        full_name, section, name = operation.target
        node = self._nodes[full_name]
        if section == 'parameters':
            change = ParameterChange(node, self._before[full_name], self._after[full_name])
            self._undo.append(change.apply(operation))
            return
        entities = node.entities[section]
        before = entities.get(name)
        spec = getattr(node.spec, section).get(name)
        if operation.action is Action.CHANGE and before is not None:
            old = getattr(self._before[full_name], section)[name]
            self._undo.append(partial(node.change, operation.noun, old, before))
            node.change(operation.noun, spec, before)
            return
        if operation.action in _COMING:
            node.drop_limits(operation.noun, name)
            created = self._create(operation.target, node, spec)
            self._undo.append(created.destroy)
            if section == 'timers':
                self._finish.append(partial(_start_timer, created))
            self._undo.append(partial(entities.pop, name, None))
            entities[name] = created
        if before is not None:
            self._undo.append(partial(entities.__setitem__, name, before))
            self._finish.append(before.destroy)
        if operation.action is Action.REMOVE:
            entities.pop(name, None)
            self._finish.append(partial(node.forget, operation.noun, name))


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


def _create_again(node: LiveNode, section: str, spec: Any) -> None:
    node.entities[section][spec.name] = create_entity(node, section, spec)


def _is_in_a_call(node: LiveNode) -> bool:
    """Return whether a behaviour of a node runs that ends soon: no goal, and no coroutine."""
    return any(call.thread is not None and call.progress is None for call in node.running.calls())


def _set_sim_time(node: LiveNode, *, value: bool) -> None:
    (result,) = node.ros.set_parameters([Parameter('use_sim_time', value=value)])
    if not result.successful:
        message = f"parameter 'use_sim_time' of '{node.spec.key}': {result.reason}"
        raise StartError(message)


def _start_timer(timer: Any) -> None:
    with suppress(Exception):
        # A behaviour may have destroyed it.
        timer.ros.reset()
