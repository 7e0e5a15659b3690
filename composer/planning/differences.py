"""Two snapshots of a system → the operations that turn the one into the other.

A node is the same as before if it has the same full name, and an entity if it has the same section
and name in it. What ROS fixes when something is created can only change with it: that is
recreated. All else changes in place.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import ENTITY_KINDS
from composer.language.bindings import exit_bindings, node_bindings
from composer.language.specs import (
    ComponentSpec,
    NodeSpec,
    ParameterSpec,
    ProcessSpec,
    WorkerSpec,
)
from composer.names import expand_name, remap_name
from composer.network.variables import find_sought
from composer.planning.changes import Reading, compare_entries, compare_fields
from composer.planning.notes import with_notes
from composer.planning.plan import Action, Change, Operation, Plan
from composer.planning.snapshot import Snapshot
from composer.records import record
from composer.yaml_text.positions import SourceMap

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from composer.diagnostics import Span
    from composer.entity_kinds import EntityKind
    from composer.language.bindings import Binding
    from composer.language.specs import SystemSpec
    from composer.planning.plan import Target

# Nothing that runs depends on these, they tell apart what is compared, or they are compared apart.
_NOT_COMPARED = {
    *('path', 'name', 'namespace', 'external', 'parameter_files', 'state', 'components'),
    *('nodes', 'declares_all_ends', 'followed'),
    # The part of a host has other nodes and processes then; one that runs all of them does not
    # care.
    'host',
    *(kind.section for kind in ENTITY_KINDS),
}
# These are part of a node, and what a process is started with.
_ARGUMENTS = {'namespace', 'parameters', 'parameter_files', 'external'}
_CHANNELS = [kind.channel for kind in ENTITY_KINDS if kind.channel]


@record
class _Rules:
    """How things of one kind change.

    Attributes:
        noun: One of them in words.
        lost: What goes with one.
        fixed: The keys that only a new one can have another value of, and why.
    """

    noun: str
    lost: str
    fixed: Mapping[str, str]


_PARAMETERS = _Rules(
    'parameter',
    'a value set while it ran',
    dict.fromkeys(('type', 'read_only'), 'ROS fixes this when the parameter is declared'),
)
_FIXED = {
    **dict.fromkeys(
        ('type', *_CHANNELS, 'qos', 'qos_overrides', 'raw', 'content_filter', 'active', 'made_by'),
        'ROS fixes this when it is created',
    ),
    **dict.fromkeys(('group', 'clock'), 'rclpy fixes this when it is created'),
}
_LOST = {
    'publishers': 'messages not delivered yet',
    'subscriptions': 'messages queued',
    'timers': 'its phase',
    'sources': 'what it has not read yet',
    'services': 'requests queued',
    'service_clients': 'responses that calls wait for',
    'actions': 'results not fetched yet',
    'action_clients': 'the results of goals in flight',
}
# With another one of these, a subscription has no use for what waits.
_OTHER_MESSAGES = {'topic', 'type', 'raw', 'content_filter'}
# One that is recreated keeps it.
_WITH_OWN_STATE = ('subscriptions', 'timers', 'sources', 'services', 'actions')
_ENTITIES = {
    kind.section: _PARAMETERS
    if kind.section == 'parameters'
    else _Rules(kind.noun, _LOST[kind.section], _FIXED)
    for kind in ENTITY_KINDS
}
_NODES = _Rules(
    'node',
    'its state, parameters set while it ran, all that is queued',
    {
        **dict.fromkeys(
            (
                *('remap', 'rosout', 'parameter_services', 'type_description_service'),
                *('logger_services', 'lifecycle'),
            ),
            'ROS reads this when the node is created',
        ),
        'parameter_files': 'its parameters are declared from them when it is created',
        'worker': 'a node runs in one process',
        'class': 'its instance is made with the node',
    },
)
# The other fields of a process say how it is kept, not how it runs.
_PROCESSES = _Rules(
    'process',
    'the running process',
    dict.fromkeys(
        (
            *('command', 'package', 'executable', 'launch', 'arguments'),
            *('name', 'namespace'),
            *('parameters', 'parameter_files', 'remap', 'log_level', 'env', 'cwd'),
        ),
        'a process takes this when it starts',
    )
    | {'on_demand': 'it starts at another time', 'external': 'it runs elsewhere, or here'},
)
_COMPONENTS = _Rules(
    'component',
    'its state',
    dict.fromkeys(
        (
            *('namespace', 'package', 'plugin', 'parameters', 'parameter_files', 'remap'),
            *('log_level', 'intra_process', 'extra_arguments', 'is_named'),
        ),
        'a component takes this when it is loaded',
    ),
)
_WORKERS = _Rules(
    'worker',
    'the running process',
    {'environment': 'a process takes this when it starts'},
)
_SYSTEM = _Rules(
    'system',
    'all that is not in the files',
    {
        'environment': 'ROS reads this when it starts',
        'interfaces': 'a process can load an interface package once',
        **dict.fromkeys(('network', 'hosts'), 'the middleware reads this when it starts'),
    },
)
_OF_THE_SYSTEM = (
    'environment',
    'threads',
    'shutdown_timeout_sec',
    'diagnostics_period_sec',
)
_EVENT_KEYS = {
    key.key for kind in ENTITY_KINDS for key in kind.behaviours if key.arguments[-1] == 'event'
}
_AT_ITS_START = ('on_start', 'wait_for', 'delay', 'lifecycle')
# Parameters of every node, and the keys of a node that set them where parameter files do not.
_GIVEN_BY_ROS = {
    'use_sim_time': 'use_sim_time',
    'start_type_description_service': 'type_description_service',
}


def compare(old: Snapshot, new: Snapshot) -> Plan:
    """Return what must be done to turn the system of `old` into that of `new`."""
    return Plan(new.spec.name, tuple(_Comparison(old, new).operations()))


def find_new_start(old: Snapshot, new: Snapshot) -> Operation | None:
    """Return why a running system cannot become that of `new`; `None` if it can."""
    found = _Comparison(old, new).compare_system()
    return next((each for each in found if each.action is Action.RECREATE), None)


def keep_start(snapshot: Snapshot) -> Snapshot:
    """Return what `find_new_start` compares: nothing of nodes, processes and workers."""
    spec = replace(snapshot.spec, nodes={}, processes={}, workers={})
    positions = SourceMap(snapshot.positions.source)
    return Snapshot(spec, positions, {}, {}, snapshot.definitions, {})


class _Comparison:
    def __init__(self, old: Snapshot, new: Snapshot) -> None:
        self._old, self._new = old, new
        self._stale = new.stale_modules(old)
        self._renewed: set[str] = set()
        self._has_same_profiles = repr(old.spec.qos) == repr(new.spec.qos)

    def operations(self) -> Iterator[Operation]:
        yield from self.compare_system()
        old, new = self._old.spec, self._new.spec
        yield from self._compare_workers()
        for name in dict.fromkeys([*old.processes, *new.processes]):
            process = (old.processes.get(name), new.processes.get(name))
            further = [*self._changed_code(*process)]
            # One whose data are the same was not read again.
            if process[0] is not process[1] or further:
                own = [*self._compare(_PROCESSES, ('', 'processes', name), *process, further)]
                yield from own
                if any(each.action is not Action.CHANGE for each in own):
                    continue
            yield from self._compare_components(*process)
        before = {node.full_name: node for node in old.nodes.values()}
        after = {node.full_name: node for node in new.nodes.values()}
        for full_name in dict.fromkeys([*before, *after]):
            yield from self._compare_nodes(full_name, before.get(full_name), after.get(full_name))

    def _compare_workers(self) -> Iterator[Operation]:
        """Yield what is done to the workers, and learn which start anew."""
        before, after = self._old.spec.workers, self._new.spec.workers
        for name in dict.fromkeys([*before, *after]):
            target = ('', 'workers', name)
            for each in self._compare(_WORKERS, target, before.get(name), after.get(name)):
                if each.action is Action.RECREATE:
                    self._renewed.add(name)
                yield each

    def _compare_components(
        self, old: ProcessSpec | None, new: ProcessSpec | None
    ) -> Iterator[Operation]:
        """Yield what is done to the components of a container that stays."""
        if old is None or new is None:
            return
        for key in dict.fromkeys([*old.components, *new.components]):
            before, after = old.components.get(key), new.components.get(key)
            further: list[Change] = []
            if before is not None and after is not None:
                further += self._changed_values(before, after)
                if before is after and not further:
                    continue
            target = (new.name, 'components', key)
            yield from self._compare(_COMPONENTS, target, before, after, further)

    def _changed_values(self, old: ComponentSpec, new: ComponentSpec) -> Iterator[Change]:
        """Yield the parameters of a component that have another value in parameter files."""
        before = self._old.overrides.get(old.full_name, {})
        after = self._new.overrides.get(new.full_name, {})
        for name in dict.fromkeys([*before, *after]):
            first, last = before.get(name), after.get(name)
            old_value, old_span = (first.value, first.value_span) if first else (None, None)
            new_value, new_span = (last.value, last.value_span) if last else (None, None)
            if repr(old_value) != repr(new_value):
                yield Change(f'parameters.{name}', old_value, new_value, old_span, new_span)

    def _changed_code(self, old: ProcessSpec | None, new: ProcessSpec | None) -> Iterator[Change]:
        """Yield the behaviours of a process whose source differs."""
        if old is None or new is None:
            return
        before = {each.behaviour.name for each in exit_bindings(old)}
        for name in dict.fromkeys(each.behaviour.name for each in exit_bindings(new)):
            if name in before and name.partition(':')[0] in self._stale:
                before_span, after_span = (
                    Reading(snapshot, spec, spec.path).find_span('on_exit')
                    for snapshot, spec in ((self._old, old), (self._new, new))
                )
                yield Change('on_exit', name, name, before_span, after_span, is_code=True)

    def compare_system(self) -> Iterator[Operation]:
        old, new = self._reading(self._old), self._reading(self._new)
        changes = [*compare_fields(old, new, _OF_THE_SYSTEM), *self._changed_packages(old, new)]
        for key, values in (('network', _network_of), ('hosts', find_sought)):
            changes += compare_entries(
                old, new, key, *(values(each.record) for each in (old, new))
            )
        if changes:
            target = ('', 'system', self._new.spec.name)
            span = self._new.positions.value(())
            yield _modification(_SYSTEM, target, self._new.spec.name, span, changes)

    def _changed_packages(self, old: Reading, new: Reading) -> Iterator[Change]:
        """Yield the packages that are loaded, and are others now."""
        loaded, present = self._old.definitions, self._new.definitions
        packages = {package for package, _ in loaded}
        differing = {at[0] for at in {**loaded, **present} if loaded.get(at) != present.get(at)}
        for package in sorted(packages & differing):
            key = f'interfaces.{package}'
            before, after = (each.record.interfaces.get(package) for each in (old, new))
            spans = old.find_span(key), new.find_span(key)
            yield Change(key, before, after, spans[0], spans[1], is_code=after is not None)

    def _compare_nodes(
        self, full_name: str, old: NodeSpec | None, new: NodeSpec | None
    ) -> Iterator[Operation]:
        is_renewed = old is not None and new is not None and new.worker in self._renewed
        if new is not None and self._is_same(old, new) and not is_renewed:
            return
        further: list[Change] = []
        if old is not None and new is not None:
            readings = Reading(self._old, old, old.path), Reading(self._new, new, new.path)
            further += compare_entries(*readings, 'state', old.state, new.state)
            further += self._changed_by_files(*readings)
            further += self._changed_classes(*readings)
        target = (full_name, 'nodes', '')
        own = list(self._compare(_NODES, target, old, new, further))
        if new is not None and is_renewed:
            own = [self._renew(new, own)]
        yield from own if old is None else (with_notes(each, old, self._old) for each in own)
        if old is None or new is None or any(each.action is Action.RECREATE for each in own):
            return
        for kind in ENTITY_KINDS:
            yield from self._compare_entities(kind, old, new)

    def _renew(self, node: NodeSpec, own: list[Operation]) -> Operation:
        """Return what is done to a node that goes with its worker, whatever else changes in it."""
        changes = own[0].changes if own else ()
        reason = next((each.reason for each in own if each.reason), 'its worker starts anew')
        span = self._new.positions.key(node.path)
        target, lost = (node.full_name, 'nodes', ''), (_NODES.lost,)
        return Operation(
            Action.RECREATE, _NODES.noun, target, _name(node), span, changes, reason, lost
        )

    def _is_same(self, old: NodeSpec | None, new: NodeSpec) -> bool:
        """Return whether a node was not read again, and all that it refers to is the same."""
        name = new.full_name
        return (
            old is new
            and self._has_same_profiles
            and not (self._old.overrides.get(name) or self._new.overrides.get(name))
            and not any(each.behaviour.module in self._stale for each in node_bindings(new))
        )

    def _compare_entities(
        self, kind: EntityKind, old: NodeSpec, new: NodeSpec
    ) -> Iterator[Operation]:
        rules = _ENTITIES[kind.section]
        before, after = getattr(old, kind.section), getattr(new, kind.section)
        if not (before or after):
            return
        for name in dict.fromkeys([*before, *after]):
            further: Iterable[Change] = ()
            if rules is _PARAMETERS:
                further = self._changed_override(name, old, new)
            elif getattr(after.get(name), 'qos_overrides', ()):
                further = self._changed_qos(kind, name, old, new)
            target = (new.full_name, kind.section, name)
            entity = (before.get(name), after.get(name))
            for operation in self._compare(rules, target, *entity, further, (old, new)):
                is_new = operation.action is Action.ADD
                yield operation if is_new else with_notes(operation, old, self._old)

    @staticmethod
    def _changed_by_files(old: Reading, new: Reading) -> Iterator[Change]:
        """Yield the keys of a node for which its parameter files say something else now."""
        for name, key in _GIVEN_BY_ROS.items():
            entries = [
                side.snapshot.overrides.get(side.record.full_name, {}).get(name)
                for side in (old, new)
            ]
            if any(entries):
                (before, old_span), (after, new_span) = (
                    (entry.value, entry.value_span)
                    if entry
                    else (getattr(side.record, key), side.find_span(key))
                    for side, entry in zip((old, new), entries, strict=True)
                )
                if before != after:
                    yield Change(key, before, after, old_span, new_span)
        if new.record.automatically_declare_parameters_from_overrides:
            known = {*old.record.parameters, *new.record.parameters, *_GIVEN_BY_ROS}
            yield from _changed_values(old, new, lambda name: name not in known)

    def _changed_qos(
        self, kind: EntityKind, name: str, old: NodeSpec, new: NodeSpec
    ) -> Iterator[Change]:
        """Yield what parameter files say else now of the QoS of a publisher or subscription."""
        topic = getattr(new, kind.section)[name].topic
        expanded = expand_name(topic, new.name, new.namespace)
        full = remap_name(expanded, new.remap, new.name, new.namespace, 'rostopic')
        start = f'qos_overrides.{full}.{kind.noun}.'
        readings = Reading(self._old, old, old.path), Reading(self._new, new, new.path)
        for change in _changed_values(*readings, lambda each: each.startswith(start)):
            yield replace(change, key=f'qos.{change.key.rpartition(".")[2]}')

    def _changed_classes(self, old: Reading, new: Reading) -> Iterator[Change]:
        """Yield the classes of behaviours that have other code now."""
        before, after = map(_find_classes, (old, new))
        for name in before.keys() & after.keys():
            codes = [
                side.snapshot.code_of(bindings[name].behaviour)
                for side, bindings in ((old, before), (new, after))
            ]
            if codes[0] != codes[1]:
                yield Change(
                    'class',
                    name,
                    name,
                    old.snapshot.positions.value(before[name].behaviour.path),
                    new.snapshot.positions.value(after[name].behaviour.path),
                    is_code=True,
                )

    def _changed_override(self, name: str, old: NodeSpec, new: NodeSpec) -> Iterator[Change]:
        """Yield the change of what parameter files say of a parameter."""
        before = self._old.overrides.get(old.full_name, {}).get(name)
        after = self._new.overrides.get(new.full_name, {}).get(name)
        old_value, old_span = (before.value, before.value_span) if before else (None, None)
        new_value, new_span = (after.value, after.value_span) if after else (None, None)
        if repr(old_value) != repr(new_value):
            yield Change('value', old_value, new_value, old_span, new_span)

    def _compare(
        self,
        rules: _Rules,
        target: Target,
        old: Any,
        new: Any,
        further: Iterable[Change] = (),
        nodes: tuple[NodeSpec | None, NodeSpec | None] = (None, None),
    ) -> Iterator[Operation]:
        """Yield what is done to one thing, of which each side may have none."""
        if old is None:
            span = self._new.positions.key(new.path)
            yield Operation(Action.ADD, rules.noun, target, _name(new), span)
        elif new is None:
            span = self._old.positions.key(old.path)
            own = ('own_state',) if target[1] in _WITH_OWN_STATE else ()
            lost = (rules.lost, *own)
            yield Operation(Action.REMOVE, rules.noun, target, _name(old), span, lost=lost)
        else:
            readings = (
                Reading(self._old, old, old.path, nodes[0]),
                Reading(self._new, new, new.path, nodes[1]),
            )
            changes = [*compare_fields(*readings, _compared_fields(new.__class__)), *further]
            if changes:
                span = self._new.positions.key(new.path)
                yield _modification(rules, target, _name(new), span, changes)

    @staticmethod
    def _reading(snapshot: Snapshot) -> Reading:
        return Reading(snapshot, snapshot.spec, ())


def _changed_values(
    old: Reading, new: Reading, is_wanted: Callable[[str], bool]
) -> Iterator[Change]:
    """Yield the parameters to which parameter files give another value now."""
    before, after = (side.snapshot.overrides.get(side.record.full_name, {}) for side in (old, new))
    for name in filter(is_wanted, dict.fromkeys([*before, *after])):
        was, now = before.get(name), after.get(name)
        if repr(was and was.value) != repr(now and now.value):
            yield Change(
                f'parameter_files.{name}',
                was and was.value,
                now and now.value,
                was.value_span if was else None,
                now.value_span if now else None,
            )


def _find_classes(reading: Reading) -> dict[str, Binding]:
    """Return the classes of a node's behaviours, each with the first of these."""
    found: dict[str, Binding] = {}
    for binding in node_bindings(reading.record):
        behaviour = binding.behaviour
        if behaviour.class_name:
            found.setdefault(f'{behaviour.module}:{behaviour.class_name}', binding)
    return found


@cache
def _compared_fields(kind: Any) -> tuple[str, ...]:
    """Return the fields of a class of records that are compared."""
    # ROS knows the description of a parameter; nobody asks for the others.
    skipped = _NOT_COMPARED if kind is ParameterSpec else {*_NOT_COMPARED, 'description'}
    if kind in (ProcessSpec, ComponentSpec):
        skipped -= _ARGUMENTS
    if kind is NodeSpec:
        # Its entities say it, too.
        skipped |= {'local_delivery'}
    return tuple(each.name for each in fields(kind) if each.name not in skipped)


def _reason_of_event(change: Change) -> str:
    """Return why a behaviour for a QoS event cannot come or go; it can be another one."""
    is_exchanged = change.old is not None and change.new is not None
    is_event = change.key in _EVENT_KEYS and not is_exchanged
    return 'rclpy asks for an event when this is created' if is_event else ''


def _reason_of_niceness(change: Change, rules: _Rules) -> str:
    """Return why a worker cannot take a niceness: only a new process has less than it had."""
    is_less = rules is _WORKERS and change.key == 'nice' and (change.new or 0) < (change.old or 0)
    return 'a process cannot become less nice' if is_less else ''


def _modification(
    rules: _Rules, target: Target, name: str, span: Span, changes: list[Change]
) -> Operation:
    reasons = (
        rules.fixed.get(each.key)
        or rules.fixed.get(each.top_key)
        or _reason_of_event(each)
        or _reason_of_niceness(each, rules)
        for each in changes
        # Where a lifecycle starts counts from the next start.
        if not (each.key == 'lifecycle' and each.old and each.new)
    )
    reason = next(filter(None, reasons), '')
    keys = dict.fromkeys(each.top_key for each in changes)
    keeps_queue = target[1] == 'subscriptions' and not keys.keys() & _OTHER_MESSAGES
    at_start = _AT_ITS_START if rules is not _PROCESSES else ('wait_for', 'delay')
    late = [key for key in keys if key in at_start and not reason]
    return Operation(
        Action.RECREATE if reason else Action.CHANGE,
        rules.noun,
        target,
        name,
        span,
        tuple(changes),
        reason,
        (rules.lost,) if reason and not keeps_queue else (),
        tuple(f'{key} counts from its next start' for key in late),
    )


def _network_of(spec: SystemSpec) -> dict[str, Any]:
    """Return what the file says of the network, by its keys."""
    network = spec.network
    if network is None:
        return {}
    given = {each.name: getattr(network, each.name) for each in fields(network)}
    return {
        key: each for key, each in given.items() if each not in (None, '', ()) and key != 'path'
    }


def _name(spec: Any) -> str:
    """Return the key under which something stands in the file."""
    # A worker may have none, and only be named by a node.
    return spec.name if isinstance(spec, WorkerSpec) else str(spec.path[-1])
