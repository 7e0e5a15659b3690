"""Check the QoS of publishers and subscriptions, clients and servers for matches."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

from composer.language.qos import (
    BEST_OF_PUBLISHERS,
    BEST_OF_SERVICES,
    QosError,
    resolve_qos,
    settle_best_available,
)
from composer.language.qos_conflicts import QosConflict, find_qos_conflicts

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Related
    from composer.language.specs import QosSpec
    from composer.yaml_text.positions import DataPath

Policies = tuple[tuple[str, Any], ...]


def check_qos_pairs(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the QoS of all ends of a topic or service can match.

    What has the same QoS is looked at once: one finding for each pair of different ones.
    """
    for kind in ('topic', 'service'):
        for channel in context.topology.of_kind(kind):
            if channel.providers and channel.users:
                yield from _check_channel(context, channel)


def _check_channel(context: CheckContext, channel: Channel) -> Iterator[Diagnostic]:
    providers = _by_policies(context, channel.providers)
    users = _by_policies(context, channel.users)
    for (offered, provider), (requested, user) in product(providers.items(), users.items()):
        conflicts = list(_find_conflicts(channel, dict(offered), dict(requested)))
        if conflicts:
            yield _explain(context, channel, provider, user, conflicts)


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
