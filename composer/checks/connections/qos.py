"""Check that the QoS of all ends of a topic or service can match, and that deadlines are kept."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from composer.language.qos import (
    BEST_OF_PUBLISHERS,
    BEST_OF_SERVICES,
    INFINITE,
    QosError,
    resolve_qos,
    settle_best_available,
)
from composer.language.qos_conflicts import MATCHED_POLICIES, QosConflict, find_qos_conflicts

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Related
    from composer.language.specs import NodeSpec, PublisherSpec, QosSpec, TimerSpec
    from composer.yaml_text.positions import DataPath

Policies = tuple[tuple[str, Any], ...]


def check_qos_pairs(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the QoS of all ends of a topic or service can match.

    One finding for each pair of different QoS that cannot match. The work grows with the number of
    ends, and of different policies that a match depends on, not with that of all pairs.
    """
    for kind in ('topic', 'service'):
        for channel in context.topology.of_kind(kind):
            if channel.providers and channel.users:
                yield from _check_channel(context, channel)


def _check_channel(context: CheckContext, channel: Channel) -> Iterator[Diagnostic]:
    users = _by_policies(context, channel.users)
    by_matched = _group(users)

    @cache
    def conflicting_users(offered: Policies) -> list[tuple[int, list[QosConflict]]]:
        """Return which users do not match what is offered, in their order, and why."""
        found = (
            (indices, list(_find_conflicts(channel, dict(offered), dict(requested))))
            for requested, indices in by_matched.items()
        )
        return sorted((index, why) for indices, why in found if why for index in indices)

    ends = list(users.values())
    for offered, provider in _by_policies(context, channel.providers).items():
        for index, conflicts in conflicting_users(_matched(offered)):
            yield _explain(context, channel, provider, ends[index], conflicts)


def _matched(policies: Policies) -> Policies:
    """Return the policies that a match depends on."""
    return tuple(each for each in policies if each[0] in MATCHED_POLICIES)


def _group(ends: Iterable[Policies]) -> dict[Policies, list[int]]:
    """Return the positions of the QoS that are matched alike."""
    groups: dict[Policies, list[int]] = {}
    for index, policies in enumerate(ends):
        groups.setdefault(_matched(policies), []).append(index)
    return groups


def _by_policies(context: CheckContext, ends: Iterable[Endpoint]) -> dict[Policies, Endpoint]:
    """Return the first end of each QoS; those without a known QoS are left out."""
    found: dict[Policies, Endpoint] = {}
    for end in ends:
        spec = end.qos
        if spec is None or context.was_dropped((*end.path, 'qos')):
            continue
        if any(_is_unknown(context, path) for path in _sources(context, spec)):
            continue
        try:
            policies = resolve_qos(spec, context.spec.qos)
        except QosError:
            continue
        found.setdefault(tuple(sorted(policies.items())), end)
    return found


def _sources(context: CheckContext, spec: QosSpec) -> Iterator[DataPath]:
    """Yield the paths that a QoS depends on: its own, and those of its profiles."""
    yield spec.path
    profiles = context.spec.qos
    seen: set[str] = set()
    while spec.profile in profiles and spec.profile not in seen:
        seen.add(spec.profile)
        spec = profiles[spec.profile]
        yield spec.path


def _is_unknown(context: CheckContext, path: DataPath) -> bool:
    """Return whether part of a QoS was wrong, or depends on a sample."""
    known = context.system
    if not path or not (known.dropped or known.sampled):
        return False
    sampled = (span for span in known.sampled)
    lines = {known.positions.value(path).line, known.positions.key(path).line}
    return any(dropped[: len(path)] == path for dropped in known.dropped) or any(
        span.line in lines for span in sampled
    )


def check_deadlines(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that timers publish as often as the deadlines of their publishers ask for.

    Where only timers publish, nothing can publish more often. What a publisher cannot keep, no
    subscription can ask for: their deadlines are no shorter, or do not match.
    """
    for node in context.spec.nodes.values():
        if node.path in context.incomplete:
            continue
        published = _published_by_behaviours(context, node)
        for publisher in node.publishers.values():
            deadline_sec = _known_deadline_sec(context, publisher)
            timers = _sources_of(context, node, publisher)
            if deadline_sec is None or not timers or published is None:
                continue
            period_sec = 1 / sum(1 / timer.period_sec for timer in timers)
            if publisher.name not in published and period_sec > deadline_sec:
                yield _explain_deadline(context, publisher, timers, deadline_sec, period_sec)


def _published_by_behaviours(context: CheckContext, node: NodeSpec) -> set[str] | None:
    """Return what the behaviours of a node publish by themselves; `None` if anything."""
    readings = context.readings(node)
    if any(each.reaches_ros or 'publisher' in each.open_kinds for each in readings):
        return None
    return {use.name for each in readings for use in each.uses if use.kind == 'publisher'}


def _known_deadline_sec(context: CheckContext, publisher: PublisherSpec) -> float | None:
    if any(_is_unknown(context, path) for path in _sources(context, publisher.qos)):
        return None
    try:
        deadline = resolve_qos(publisher.qos, context.spec.qos).get('deadline', INFINITE)
    except QosError:
        return None
    # 0 means no deadline, too.
    return None if isinstance(deadline, str) else deadline or None


def _sources_of(
    context: CheckContext, node: NodeSpec, publisher: PublisherSpec
) -> list[TimerSpec]:
    """Return the timers that publish on a publisher; none if other things do, or may."""
    triggers = [each for each in node.triggers if each.publish == publisher.name]
    timers = [each for each in node.timers.values() if each.publish == publisher.name]
    positions, sampled = context.system.positions, context.system.sampled
    for timer in timers:
        keys = ((*timer.path, 'period'), (*timer.path, 'rate'))
        # Simulated time may pass faster than that of the middleware.
        is_simulated = timer.clock == 'ros' and node.use_sim_time
        if is_simulated or any(positions.values.get(key) in sampled for key in keys):
            return []
    return timers if len(timers) == len(triggers) else []


def _explain_deadline(
    context: CheckContext,
    publisher: PublisherSpec,
    timers: list[TimerSpec],
    deadline_sec: float,
    period_sec: float,
) -> Diagnostic:
    path = context.inner(context.inner(publisher.path, 'qos'), 'deadline')
    who = f"timer '{timers[0].name}' publishes" if len(timers) == 1 else 'its timers publish'
    return context.at_value(
        path,
        'missed-deadline',
        f"publisher '{publisher.name}' promises a message every {deadline_sec:g} s, and {who} "
        f'one every {period_sec:g} s',
        help='make the deadline longer than the period',
        related=[
            *_place_of_deadline(context, publisher),
            *(context.related(timer.path, 'this publishes on it') for timer in timers),
        ],
    )


def _place_of_deadline(context: CheckContext, publisher: PublisherSpec) -> Iterator[Related]:
    """Yield where a profile that the publisher uses promises its deadline."""
    for source in _sources(context, publisher.qos):
        path = (*source, 'deadline')
        if source[:1] == ('qos',) and path in context.system.positions.values:
            yield context.related(path, 'it is promised here')
            return


def _find_conflicts(
    channel: Channel, provided: Mapping[str, Any], used: Mapping[str, Any]
) -> Iterator[QosConflict]:
    if channel.kind == 'topic':
        yield from find_qos_conflicts(settle_best_available(provided, BEST_OF_PUBLISHERS), used)
        return
    server, client = (settle_best_available(each, BEST_OF_SERVICES) for each in (provided, used))
    yield from find_qos_conflicts(server, client)
    # A service is two topics: here the client publishes, and the server hears.
    yield from find_qos_conflicts(client, server)


def _explain(
    context: CheckContext,
    channel: Channel,
    provider: Endpoint,
    user: Endpoint,
    conflicts: list[QosConflict],
) -> Diagnostic:
    # Where only one of them says its QoS, that one departs from what ROS does by itself.
    speaks = [(*end.path, 'qos') in context.system.positions.values for end in (provider, user)]
    here, there = (provider, user) if speaks == [True, False] else (user, provider)
    if provider.is_declared != user.is_declared:
        # What a program does is a fact; a node can follow it.
        here, there = (user, provider) if provider.is_declared else (provider, user)
    listed = '; '.join(map(str, conflicts))
    return context.at_value(
        _place(context, here, conflicts[0].policy),
        'incompatible-qos',
        f"on {channel.kind} '{channel.name}' the QoS of {provider} and of {user} never match: "
        f'{listed}',
        help=f'give both the same {conflicts[0].policy}',
        related=list(_related(context, there, here, conflicts[0].policy)),
    )


def _place(context: CheckContext, end: Endpoint, policy: str) -> DataPath:
    path = context.inner(end.path, 'qos')
    return context.inner(path, policy) if path != end.path else path


def _related(
    context: CheckContext, there: Endpoint, here: Endpoint, policy: str
) -> Iterator[Related]:
    yield context.related_value(_place(context, there, policy), f'the other end: {there}')
    for end in (here, there):
        profile = end.qos.profile if end.qos else ''
        while profile in context.spec.qos:
            spec = context.spec.qos[profile]
            if policy in spec.policies:
                message = f"the profile '{profile}' sets it"
                yield context.related_value((*spec.path, policy), message)
                break
            profile = spec.profile
