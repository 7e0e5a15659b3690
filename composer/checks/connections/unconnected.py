"""Publishers, subscriptions and clients without another end.

A warning: the other end may be elsewhere, which `external: true` says.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from composer.checks.connections.topology import (
    OF_ACTIONS,
    TOPICS_OF_ROS,
    Channel,
    full_name,
    is_misnamed,
)
from composer.checks.connections.typos import find_typo, is_slip
from composer.spelling import count_edits, did_you_mean, find_nearest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.connections.topology import Endpoint, Topology
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind

_CLOCK, _CLOCK_TYPE = '/clock', 'rosgraph_msgs/msg/Clock'
# Names are compared one by one; a file that wants more suggestions is checked without the rest.
_MOST_COMPARED = 5_000


def check_other_ends(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that every end has another end, or is marked as external."""
    is_known = _knows_all_ends(context)
    partners = _Partners(context.topology)
    for channel in context.topology.channels.values():
        if not _is_alone(context, channel):
            continue
        for end in channel.ends:
            if end.kind.unmatched and not getattr(end.entity, 'external', True):
                near = partners.nearest(channel, end)
                # A program may well publish what nobody here needs.
                is_missed = is_known and not (end.is_declared and end.kind.provides)
                if not (is_missed or (near and _is_likely(context, end, channel, near))):
                    continue
                yield _explain(context, channel, end, near, *end.kind.unmatched)


def check_clock(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that somebody may publish the time that nodes with `use_sim_time` follow."""
    spec, topology = context.spec, context.topology
    nodes = spec.nodes.values()
    unused = context.system.unused
    programs = [*spec.processes, *spec.components, *(unused.processes if unused else ())]
    if programs or not any(node.use_sim_time for node in nodes) or not _knows_all_ends(context):
        return
    awaited = {condition.name for node in nodes for condition in node.wait_for}
    if any(reading.reaches_ros for node in nodes for reading in context.readings(node)):
        return
    for node in nodes:
        key: tuple[ChannelKind, str] = ('topic', full_name(node, 'topic', _CLOCK))
        channel = topology.channels.get(key, Channel(*key))
        # What is heard or awaited here may be published elsewhere; a file may say `false`.
        is_open = bool(channel.ends) or channel.name in awaited
        is_open |= bool(node.parameter_files) or key in topology.left_out
        if node.use_sim_time and not is_open and not topology.may_have_more(channel, _CLOCK_TYPE):
            yield context.at_key(
                (*node.path, 'use_sim_time'),
                'no-clock',
                f"nothing in this system publishes '{channel.name}', whose time this node has",
                help='add what publishes it, such as a simulator, under processes',
            )


def _knows_all_ends(context: CheckContext) -> bool:
    """Return whether no program publishes, hears or serves anything that is not declared."""
    processes = context.spec.processes.values()
    lost = any(path[:1] == ('processes',) for path in context.system.dropped)
    return not lost and all(process.declares_all_ends for process in processes)


def _is_likely(context: CheckContext, end: Endpoint, channel: Channel, near: str) -> bool:
    """Return whether a name means another one, although a program may have an end of that name."""
    other = context.topology.channels[channel.kind, near]
    # What one node hears and publishes may well be called alike: `scan` and `scans`.
    if any(each.node is end.node for each in other.ends):
        return False
    is_typo = find_typo(channel.name, [near]) is not None
    return is_typo or (_is_alone(context, other) and is_slip(channel.name, near))


def _is_alone(context: CheckContext, channel: Channel) -> bool:
    topology = context.topology
    if channel.providers and channel.users:
        return False
    if (channel.kind, channel.name) in topology.left_out:
        return False
    if channel.name in TOPICS_OF_ROS or channel.name in topology.ros_services:
        return False
    if OF_ACTIONS in channel.name:
        return False
    # A wrong name is a finding of its own.
    positions = context.system.positions
    has_wrong_name = any(is_misnamed(positions, end.node, end.written) for end in channel.ends)
    return not has_wrong_name and not topology.may_have_more(channel)


def _explain(
    context: CheckContext, channel: Channel, end: Endpoint, near: str | None, rule: str, text: str
) -> Diagnostic:
    inner = (*end.path, channel.kind)
    at = context.at_value if inner in context.system.positions.values else context.at_key
    help_text = "write 'external: true' if the other end is elsewhere"
    return at(
        inner,
        rule,
        text.format(channel.name),
        help=f'{did_you_mean(near)} Otherwise {help_text}' if near else help_text,
    )


class _Partners:
    """Names with an end of the right type, which an end without a match may have meant."""

    def __init__(self, topology: Topology) -> None:
        # Names are compared without their namespaces, in which all names look alike.
        self._names: dict[tuple[str, str, bool], dict[str, list[str]]] = {}
        for channel in topology.channels.values():
            last = channel.name.rpartition('/')[2]
            for ends, provides in ((channel.providers, True), (channel.users, False)):
                for end in ends:
                    key = (channel.kind, end.entity.type, provides)
                    same = self._names.setdefault(key, {}).setdefault(last, [])
                    same.append(channel.name)
        self._comparisons = 0

    def nearest(self, channel: Channel, end: Endpoint) -> str | None:
        """Return the full name that was most likely meant."""
        wants_provider = bool(channel.users)
        names = self._names.get((channel.kind, end.entity.type, wants_provider), {})
        self._comparisons += len(names)
        if self._comparisons > _MOST_COMPARED:
            return None
        same = names.get(find_nearest(channel.name.rpartition('/')[2], names) or '', ())
        self._comparisons += len(same)
        # Of several, the one whose namespace is nearest.
        return min(same, key=partial(count_edits, channel.name), default=None)
