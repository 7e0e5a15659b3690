"""A running node becomes what the files say now: its record, state, parameters and entities."""

from __future__ import annotations

import copy
from contextlib import suppress
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from composer.entity_kinds import KIND_OF_SECTION
from composer.errors import ComposerError, StartError
from composer.language.bindings import node_bindings
from composer.planning.plan import COMING, Action
from composer.runtime.entities.creators import create_entity
from composer.runtime.entities.parameters import (
    PARAMETER_HOOKS,
    create_descriptor,
    find_refusal,
    loosen_parameter,
    type_of,
)
from composer.runtime.entities.subscriptions import Subscription
from composer.runtime.logs import set_level
from composer.runtime.nodes.live_node import class_of

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.planning.plan import Operation, Plan, Target
    from composer.runtime.entities.parameters import NodeParameters
    from composer.runtime.nodes.live_entity import LiveEntity
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.rewiring.transaction import Transaction

_POLL_SEC = 0.02
_GONE_SEC = 1.0


class NodeChange:
    """Changes of one node that runs on.

    Args:
        after: What it is declared as now.
        old: What the system was read into before.
        new: What it is read into now.
        clashing: The entities whose topic has another type after the edit.
        transaction: Takes what undoes each change.
    """

    def __init__(
        self,
        node: LiveNode,
        after: NodeSpec,
        old: Reading,
        new: Reading,
        clashing: Collection[Target],
        transaction: Transaction,
    ) -> None:
        self._node = node
        self._before, self._after = node.spec, after
        self._old, self._new = old, new
        self._clashing = clashing
        self._transaction = transaction

    def replace_record(self) -> None:
        """Let the node have its new record, and the state that this declares."""
        node, before, spec = self._node, self._before, self._after
        state = vars(node.behaviour_node.state)
        gone = {
            key: state.pop(key) for key in before.state if key not in spec.state and key in state
        }
        come = {
            key: copy.deepcopy(value)
            for key, value in spec.state.items()
            if key not in before.state and key not in state
        }
        state.update(come)
        owners = node.owners
        self._follow(spec, self._new)

        def put_back() -> None:
            self._follow(before, self._old)
            node.owners = owners
            for key in come:
                state.pop(key, None)
            state.update(gone)

        self._transaction.on_undo(put_back)

    def _follow(self, spec: NodeSpec, reading: Reading) -> None:
        node = self._node
        node.spec, node.functions = spec, reading.functions
        classes = {class_of(each.behaviour) for each in node_bindings(spec)}
        node.owners = {name: owner for name, owner in node.owners.items() if name in classes}
        entries = reading.snapshot.overrides.get(node.full_name, {})
        if entries or node.ros.from_files:
            node.ros.follow_files(entries)

    def change_entity(self, operation: Operation) -> None:
        """Add, change or remove an entity or a parameter.

        Raises:
            ComposerError: It cannot be created, or the parameter refuses its value.
        """
        node, transaction = self._node, self._transaction
        _, section, name = operation.target
        if section == 'parameters':
            change = ParameterChange(node, self._before, self._after)
            transaction.on_undo(change.apply(operation))
            return
        entities = node.entities[section]
        before = entities.get(name)
        spec = getattr(self._after, section).get(name)
        if operation.action is Action.CHANGE and before is not None:
            old = getattr(self._before, section)[name]
            transaction.on_undo(self._change_back, operation.noun, old, before)
            node.change(operation.noun, spec, before)
            return
        if before is not None:
            transaction.on_undo(entities.__setitem__, name, before)
        if operation.action in COMING:
            transaction.on_undo(node.limits.update, node.limits_of(operation.noun, name))
            transaction.on_undo(node.drop_limits, operation.noun, name)
            node.drop_limits(operation.noun, name)
            created = self._create(operation.target, spec)
            transaction.on_undo(created.destroy)
            if KIND_OF_SECTION[section].is_timed:
                transaction.on_commit(_start_timer, node, created)
            transaction.on_undo(entities.pop, name, None)
            entities[name] = created
            if isinstance(created, Subscription) and created.predecessor is not None:
                before = None
                transaction.on_replace(created.take_over)
        if before is not None:
            transaction.on_replace(before.destroy)
        if operation.action is Action.REMOVE:
            entities.pop(name, None)
            transaction.on_commit(node.forget, operation.noun, name)

    def _change_back(self, noun: str, spec: Any, entity: LiveEntity) -> None:
        self._bind_as_before()
        self._node.change(noun, spec, entity)

    def _ask_as_before(self, parameters: NodeParameters) -> None:
        self._bind_as_before()
        parameters.ask(self._before)

    def _bind_as_before(self) -> None:
        # Behaviours are bound, and limits are read, before the rest of the record comes back.
        self._node.spec, self._node.functions = self._before, self._old.functions

    def _create(self, target: Target, spec: Any) -> LiveEntity:
        """Create an entity; one whose topic gets another type when the old ends have gone."""
        deadline = monotonic() + (_GONE_SEC if target in self._clashing else 0.0)
        while True:
            try:
                return create_entity(self._node, target[1], spec)
            except StartError:
                # The middleware may still deliver to one of them.
                if monotonic() > deadline:
                    raise
            sleep(_POLL_SEC)

    def change_node(self, operation: Operation) -> None:
        """Change what the node itself does."""
        node, before, spec, transaction = self._node, self._before, self._after, self._transaction
        keys = {each.top_key for each in operation.changes}
        if 'bond' in keys and node.lifecycle:
            transaction.on_undo(node.lifecycle.follow)
            node.lifecycle.follow()
        if 'log_level' in keys:
            requests = node.system.log_levels
            transaction.on_undo(set_level, before, requests)
            set_level(spec, requests)
        if keys & {*PARAMETER_HOOKS, 'on_error', 'warn_after'} and node.parameters:
            transaction.on_undo(self._ask_as_before, node.parameters)
            node.parameters.ask(spec)
        if keys & {'on_error', 'warn_after'}:
            # Their behaviours have no such keys of their own.
            for name, client_spec in spec.action_clients.items():
                client = node.entities['action_clients'][name]
                old = before.action_clients.get(name, client_spec)
                transaction.on_undo(self._change_back, 'action client', old, client)
                node.change('action client', client_spec, client)


def set_sim_times(plan: Plan, nodes: Mapping[str, LiveNode], transaction: Transaction) -> None:
    """Change `use_sim_time` of nodes, as the last of all changes.

    rclpy has the subscription to `/clock` come and go with it: one that goes cannot be brought
    back as it was if anything else fails. So those that go, go after those that come.

    Raises:
        StartError: An `on_parameters` refuses it.
    """
    values = {}
    for operation in plan.operations:
        node = nodes.get(operation.target[0])
        keys = {each.key for each in operation.changes}
        if node and operation.action is Action.CHANGE and 'use_sim_time' in keys:
            given = node.ros.find_override('use_sim_time')
            values[node.full_name] = node.spec.use_sim_time if given is None else given
    for full_name in sorted(values, key=values.__getitem__, reverse=True):
        node = nodes[full_name]
        before = node.ros.get_parameter('use_sim_time').value
        _set_sim_time(node, value=values[full_name])
        transaction.on_undo(_set_sim_time, node, value=before)


def _set_sim_time(node: LiveNode, *, value: bool) -> None:
    (result,) = node.ros.set_parameters([Parameter('use_sim_time', value=value)])
    if not result.successful:
        message = f"parameter 'use_sim_time' of '{node.spec.key}': {result.reason}"
        raise StartError(message)


def _start_timer(node: LiveNode, timer: Any) -> None:
    with suppress(Exception):
        # A behaviour may have destroyed it.
        if not node.gate.rests:
            timer.ros.reset()


class ParameterChange:
    """Changes of the parameters of one node.

    Args:
        before: What the node was declared as.
        after: What it is declared as now.
    """

    def __init__(self, node: LiveNode, before: NodeSpec, after: NodeSpec) -> None:
        self._node = node
        self._before, self._after = before, after

    def apply(self, operation: Operation) -> Callable[[], None]:
        """Add, change or remove a parameter; return what undoes it.

        A value that somebody set while the system ran stays, unless the parameter is recreated.

        Raises:
            StartError: The node refuses the value: its declaration, or its `on_parameters`.
        """
        name = operation.target[2]
        before, after = self._before.parameters.get(name), self._after.parameters.get(name)
        node, parameters = self._node, self._node.parameters
        assert parameters is not None  # noqa: S101 - its entities have been created
        if before is None:
            parameters.declare(self._after.parameters[name])
            return lambda: parameters.undeclare(name)
        value, was_set = node.behaviour_node.parameters[name], name in parameters.set_live

        kept = node.ros.copy_parameter(name)

        def put_back() -> None:
            # Nobody is asked: it has had this value.
            node.ros.put_parameter(*kept)
            parameters.specs[name] = before
            if was_set:
                parameters.set_live.add(name)

        given = node.ros.find_override(name)
        # rclpy does not unset a parameter that has a type.
        is_unset = not was_set and after is not None and after.value is None and given is None
        try:
            if after is None or operation.action is Action.RECREATE or is_unset:
                parameters.undeclare(name)
                if after is not None:
                    parameters.declare(after)
            else:
                self._change(after, value if was_set else after.value if given is None else given)
        except ComposerError:
            put_back()
            raise
        return put_back

    def _change(self, spec: ParameterSpec, value: Any) -> None:
        """Change the descriptor of a parameter, and its value; `None` leaves that as it is."""
        ros, parameters = self._node.ros, self._node.parameters
        assert parameters is not None  # noqa: S101 - see above
        # The old limits may not fit the new value, and nobody sets what is read-only.
        loosen_parameter(ros, spec.name)
        parameters.specs[spec.name] = spec
        # `1` and `1.0` are equal, and not the same.
        if value is not None and repr(value) != repr(ros.get_parameter(spec.name).value):
            parameters.set(spec, value)
        descriptor = create_descriptor(spec)
        descriptor.type = type_of(spec).value
        reason = find_refusal(spec, ros.get_parameter(spec.name).value)
        try:
            ros.set_descriptor(spec.name, descriptor)
        except ParameterException as error:
            reason = str(error).removesuffix(f': {spec.name}')
        if reason:
            message = f"parameter '{spec.name}' of '{self._node.spec.key}': {reason}"
            raise StartError(message, help='its value was set while the system ran')
