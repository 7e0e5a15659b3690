"""Puts figures and the file of a system together: what its nodes cost, and what flows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.placement.crossing_messages import is_big
from composer.drawing.delivery import deliveries_of
from composer.errors import ComposerError
from composer.inference.sharing.shared_names import SharedNames
from composer.language.specs import NodeSpec
from composer.suggestions.loads import Flow, NodeLoad, SystemLoad

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.checks.context import CheckContext
    from composer.inference.sharing.shared_functions import SharedName
    from composer.language.specs import SystemSpec
    from composer.suggestions.figures import EntityFigures, Measured

# Of requests and responses, and of messages whose size is not known and that may be long or not.
_SMALL_BYTES = 200.0
_LARGE_BYTES = 1_000_000.0
# What is late by less may be so by chance.
_LATE = 1.05
# An interpreter that is held so long leaves no time; how much more there is to do is not known.
_SATURATED = 0.9


def build_load(
    context: CheckContext,
    spec: SystemSpec,
    measured: Measured,
    cores: int,
    fixed: frozenset[str],
) -> SystemLoad:
    """Return the load of a system.

    Args:
        spec: The system, or the part of it that is on one host.
        cores: How many processor cores there are.
        fixed: Nodes that must stay where they are, by full names.

    Raises:
        ComposerError: The figures are of other nodes, or of another split.
    """
    names = {node.full_name for node in spec.nodes.values()}
    known = {each.node for each in measured.entities} & names
    if not known:
        message = f"nothing was measured of the nodes of system '{spec.name}'"
        raise ComposerError(message, help='name the file that it ran with')
    _check_workers(spec, measured.entities)
    by_entity = {(each.node, each.kind, each.name): each for each in measured.entities}
    nodes = [_load_of(node, measured.entities) for node in spec.nodes.values()]
    return SystemLoad(
        nodes=nodes,
        flows=[
            each
            for each in _flows(context, by_entity, measured.sizes)
            if {each.source, each.sink} <= names
        ],
        cores=cores,
        demand=_demand(spec, by_entity, nodes),
        together=sorted(set(_find_sharing(context, spec)), key=sorted),
        fixed=fixed,
        taken=frozenset(spec.workers),
        others=measured.others,
    )


def _check_workers(spec: SystemSpec, entities: Iterable[EntityFigures]) -> None:
    workers = {each.node: each.worker for each in entities}
    for node in spec.nodes.values():
        worker = workers.get(node.full_name, node.worker)
        if worker != node.worker:
            ran, said = (
                f"worker '{each}'" if each else 'no worker' for each in (worker, node.worker)
            )
            message = f'{node.full_name} ran in {ran}, and the file says {said}'
            raise ComposerError(message, help='name all layers that the system ran with')


def _load_of(node: NodeSpec, entities: Iterable[EntityFigures]) -> NodeLoad:
    own = [each for each in entities if each.node == node.full_name]
    return NodeLoad(
        node.full_name,
        cpu=sum(each.cpu for each in own),
        worker=node.worker,
        is_measured=bool(own),
    )


def _flows(
    context: CheckContext,
    rates: Mapping[tuple[str, str, str], EntityFigures],
    sizes: Mapping[str, float],
) -> Iterator[Flow]:
    for channel in context.topology.channels.values():
        if channel.kind == 'topic':
            local = dict(deliveries_of(channel, context.spec.qos))
            for source, sink in _pairs(channel):
                rate = rates.get((sink.node.full_name, 'subscription', sink.entity.name))
                if rate is not None:
                    yield Flow(
                        channel.name,
                        source.node.full_name,
                        sink.node.full_name,
                        rate.rate_hz / len(channel.providers),
                        sizes.get(channel.name) or _guess_size(context, str(sink.entity.type)),
                        is_local=local[sink.path].way == 'local',
                    )
        elif channel.kind == 'service':
            for server, client in _pairs(channel):
                rate = rates.get((server.node.full_name, 'service', server.entity.name))
                if rate is not None:
                    ends = server.node.full_name, client.node.full_name
                    rate_hz = rate.rate_hz / len(channel.users)
                    for sender, taker in (ends, ends[::-1]):
                        yield Flow(channel.name, sender, taker, rate_hz, _SMALL_BYTES)


def _pairs(channel: Channel) -> Iterator[tuple[Endpoint, Endpoint]]:
    """Yield each two ends that are both of nodes of the system."""
    for provider in channel.providers:
        for user in channel.users:
            if isinstance(provider.node, NodeSpec) and isinstance(user.node, NodeSpec):
                yield provider, user


def _guess_size(context: CheckContext, type_name: str) -> float:
    """Return the size of messages of a type that were not recorded."""
    return _LARGE_BYTES if is_big(context, type_name) else _SMALL_BYTES


def _find_sharing(context: CheckContext, spec: SystemSpec) -> Iterator[frozenset[str]]:
    """Yield the nodes that change an object of a module, with those that read it."""
    names = SharedNames(context.modules)
    changed: dict[SharedName, set[str]] = {}
    read: dict[SharedName, set[str]] = {}
    for node in spec.nodes.values():
        for binding in context.bindings(node):
            uses = names.uses_of(binding.behaviour.module, binding.behaviour.function)
            for known, found in ((changed, uses.changed), (read, uses.read)):
                for name in found:
                    known.setdefault(name, set()).add(node.full_name)
    for name, changers in changed.items():
        # Where a node changes it itself, each process may have its own.
        seen_by = [nodes for each, nodes in read.items() if names.find_touched([name], each)]
        readers = set[str]().union(*seen_by) - changers
        if readers:
            yield frozenset(readers | changers)


def _demand(
    spec: SystemSpec,
    rates: Mapping[tuple[str, str, str], EntityFigures],
    nodes: Iterable[NodeLoad],
) -> float:
    """Return how many times as much there is to do as was done."""
    wanted = [1.0]
    for node in spec.nodes.values():
        for timer in node.timers.values():
            found = rates.get((node.full_name, 'timer', timer.name))
            if found is not None and found.rate_hz:
                wanted.append(1.0 / timer.period_sec / found.rate_hz)
    wanted += [
        (each.rate_hz + each.lost_hz) / each.rate_hz for each in rates.values() if each.rate_hz
    ]
    most = max(wanted)
    if most >= _LATE:
        return most
    held: dict[str, float] = {}
    for each in nodes:
        held[each.worker] = held.get(each.worker, 0.0) + each.cpu
    return float('inf') if max(held.values(), default=0.0) >= _SATURATED else 1.0
