"""Applies a plan to a running system: all of it, or nothing.

What may fail comes first, and what has been done is undone in reverse if it does. What goes, goes
last.
"""

from __future__ import annotations

import copy
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.parameter import Parameter

from composer.entity_kinds import ENTITY_KINDS
from composer.errors import ComposerError
from composer.planning.plan import Action
from composer.runtime.entities.creators import create_entity
from composer.runtime.logs import set_level, system_logger
from composer.runtime.rewiring.parameter_changes import ParameterChange

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import NodeSpec
    from composer.planning.plan import Operation, Plan
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.runtime.restart import NodeRestarter
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.start import NodeStarter


class RewiringError(ComposerError):
    """A plan could not be applied; the system is as it was."""


class Rewiring:
    """One plan on its way into a running system.

    Args:
        old: What the system runs as.
        new: What it is to run as.
    """

    def __init__(
        self,
        nodes: dict[str, LiveNode],
        handle: SystemHandle,
        starter: NodeStarter,
        restarter: NodeRestarter,
        old: Reading,
        new: Reading,
    ) -> None:
        self._nodes = nodes
        self._handle = handle
        self._starter = starter
        self._restarter = restarter
        self._old, self._new = old, new
        self._undo: list[Callable[[], object]] = []
        self._finish: list[Callable[[], object]] = []
        self._before = {node.full_name: node for node in old.spec.nodes.values()}
        self._after = {node.full_name: node for node in new.spec.nodes.values()}

    def apply(self, plan: Plan) -> None:
        """Do all that a plan says.

        Raises:
            RewiringError: Something failed, and everything is as before.
        """
        try:
            self._replace_reading()
            self._apply_to_nodes(plan)
            self._apply_to_entities(plan)
        except BaseException as error:
            self._undo_all()
            if isinstance(error, ComposerError):
                raise RewiringError(str(error), help=error.help) from error
            raise
        for finish in self._finish:
            finish()

    def _undo_all(self) -> None:
        for undo in reversed(self._undo):
            try:
                undo()
            except Exception as error:  # noqa: BLE001 - the rest must be undone
                system_logger.error(f'reload: something could not be undone: {error}')

    def _replace_reading(self) -> None:
        """Let what is created from now on, and what errors tell of places, be of the new files."""

        def put(reading: Reading) -> None:
            handle, spec = self._handle, reading.spec
            handle.positions = reading.positions
            handle.profiles = spec.qos
            handle.functions = reading.functions
            handle.stop_timeout_sec = spec.shutdown_timeout_sec
            handle.without_parameter_services = spec.without_parameter_services

        self._undo.append(lambda: put(self._old))
        put(self._new)

    def _apply_to_nodes(self, plan: Plan) -> None:
        own = [each for each in plan.operations if each.target[1] == 'nodes']
        for operation in own:
            full_name = operation.target[0]
            if operation.action is Action.REMOVE:
                self._finish.append(partial(self._restarter.remove, full_name))
            elif operation.action is Action.ADD:
                self._undo.append(partial(self._restarter.remove, full_name))
                self._restarter.add(self._after[full_name])
            elif operation.action is Action.RECREATE:
                self._recreate(self._nodes[full_name], self._after[full_name])
        for full_name, spec in self._after.items():
            self._change_node(self._nodes[full_name], spec)

    def _recreate(self, node: LiveNode, spec: NodeSpec) -> None:
        before, state = node.spec, node.behaviour_node.state
        self._restarter.replace(node, spec)

        def put_back() -> None:
            self._restarter.replace(self._nodes[before.full_name], before)
            self._nodes[before.full_name].behaviour_node.state.__dict__.update(state.__dict__)

        self._undo.append(put_back)

    def _change_node(self, node: LiveNode, spec: NodeSpec) -> None:
        """Let a node have another record, and the state that it declares."""
        before = node.spec
        if before is spec:
            return
        state = vars(node.behaviour_node.state)
        gone = {
            key: state.pop(key) for key in before.state if key not in spec.state if key in state
        }
        come = {key: spec.state[key] for key in spec.state if key not in before.state}
        state.update(
            {key: copy.deepcopy(value) for key, value in come.items() if key not in state}
        )
        node.spec = spec

        def put_back() -> None:
            node.spec = before
            for key in come:
                state.pop(key, None)
            state.update(gone)

        self._undo.append(put_back)

    def _apply_to_entities(self, plan: Plan) -> None:
        by_node: dict[str, list[Operation]] = {}
        for operation in plan.operations:
            full_name, section, _ = operation.target
            if section not in ('system', 'processes'):
                by_node.setdefault(full_name, []).append(operation)
        for full_name, operations in by_node.items():
            node = self._nodes.get(full_name)
            if node is not None:
                self._pause(node)
                self._apply_to_node(node, {each.target: each for each in operations})

    def _pause(self, node: LiveNode) -> None:
        """Let no behaviour of a node begin while its entities are exchanged."""
        gate = node.gate
        before = gate.is_open, gate.serves

        def go_on() -> None:
            gate.is_open, gate.serves = before
            self._handle.executor.wake()

        gate.close()
        self._undo.append(go_on)
        self._finish.append(go_on)

    def _apply_to_node(self, node: LiveNode, operations: Mapping[Any, Operation]) -> None:
        own = operations.get((node.spec.full_name, 'nodes', ''))
        if own is not None and own.action is Action.CHANGE:
            self._change_own(node, own)
        for kind in ENTITY_KINDS:
            for target, operation in operations.items():
                if target[1] != kind.section:
                    continue
                if kind.section == 'parameters':
                    self._undo.append(self._change_parameter(node, operation))
                else:
                    self._apply_to_entity(node, operation)

    def _change_parameter(self, node: LiveNode, operation: Operation) -> Callable[[], None]:
        full_name = operation.target[0]
        change = ParameterChange(node, self._before[full_name], self._after[full_name])
        return change.apply(operation)

    def _change_own(self, node: LiveNode, operation: Operation) -> None:
        keys = {each.top_key for each in operation.changes}
        old = self._before[operation.target[0]]
        if 'use_sim_time' in keys:
            value = node.spec.use_sim_time
            node.ros.set_parameters([Parameter('use_sim_time', value=value)])
            self._undo.append(
                lambda: node.ros.set_parameters([Parameter('use_sim_time', value=not value)])
            )
        if keys & {'on_parameters', 'with', 'on_error', 'warn_after'} and node.parameters:
            parameters = node.parameters
            self._undo.append(lambda: parameters.ask(old.on_parameters))
            parameters.ask(node.spec.on_parameters)
        if 'log_level' in keys:
            self._undo.append(lambda: set_level(old))
            set_level(node.spec)

    def _apply_to_entity(self, node: LiveNode, operation: Operation) -> None:
        full_name, section, name = operation.target
        entities = node.entities[section]
        spec = getattr(node.spec, section).get(name)
        before = entities.get(name)
        if operation.action is Action.CHANGE:
            entity = entities[name]
            old = getattr(self._before[full_name], section)[name]
            self._undo.append(lambda: entity.change(old))
            entity.change(spec)
            return
        if operation.action is Action.REMOVE:
            del entities[name]
        else:
            entities[name] = created = create_entity(node, section, spec)
            self._undo.append(created.destroy)
            if section == 'timers':
                self._finish.append(lambda: _start(created))
        if before is not None:
            self._undo.append(lambda: entities.__setitem__(name, before))
            self._finish.append(before.destroy)
        elif operation.action is Action.ADD:
            self._undo.append(partial(entities.pop, name, None))


def _start(timer: Any) -> None:
    with suppress(Exception):
        # A behaviour may have destroyed it.
        timer.ros.reset()
