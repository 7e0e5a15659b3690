"""Deadlocks: behaviours that wait for something that can run only after them.

A callback of a mutually exclusive group keeps the whole group until it returns; a coroutine keeps
it until it ends, also while it awaits (rclpy's executors and Composer's). Composer's `node.call`
gives up its thread while it waits, so there are never too few threads for those who wait.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from composer.checks.connections.cycles import find_knots, find_way
from composer.checks.connections.wait_conditions import StartOrder
from composer.diagnostics import Related
from composer.entity_kinds import KIND_OF_NOUN, TRANSITION_BEHAVIOURS
from composer.language.specs import REENTRANT, ActionClientSpec, ActionSpec, NodeSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.node_uses.reading import NodeUse, Waited
    from composer.yaml_text.positions import DataPath

_RULE = 'service-deadlock'
# Of a chain of calls, how many are named.
_MOST_SHOWN = 8

# A callback group, or what else only one has at a time: the node's full name, and its own.
Group = tuple[str, str]
# The group in which a node accepts goals.
_ACCEPTING = 'goals'


@record
class _Wait:
    """A behaviour waits for a service, or for an action: an answer, or the end of a goal.

    Attributes:
        group: The group that it keeps meanwhile, `None` for none.
        name: The full name of the service or action; `what` is what it waits for, in words.
        client: The end that it calls through.
        server: The end that would answer.
        place: Where the behaviour waits.
        answering: The behaviour that would, by its path.
        answering_group: The group that it needs, `None` for none.
    """

    node: NodeSpec
    binding: Binding
    group: Group | None
    name: str
    what: str
    client: Endpoint
    server: Endpoint
    place: Span
    answering: DataPath
    answering_group: Group | None

    @property
    def path(self) -> DataPath:
        return self.binding.behaviour.path

    def __str__(self) -> str:
        return f"{self.binding.owner} of node '{self.node.name}'"


def check_deadlocks(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no behaviour waits for something that is blocked by the behaviour itself."""
    waits = list(_find_waits(context))
    yield from _check_hooks(context, waits)
    yield from _check_groups(context, waits)


def _find_waits(context: CheckContext) -> Iterator[_Wait]:
    servers = {
        (end.kind.section, end.node.full_name, end.entity.name): (channel, end)
        for kind in ('service', 'action')
        for channel in context.topology.of_kind(kind)
        for end in channel.users
        if len(channel.providers) == 1 and isinstance(channel.providers[0].node, NodeSpec)
    }
    if not servers:
        return
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            if context.was_dropped(binding.behaviour.path):
                continue
            group = group_in(node, binding)
            for use in _waiting_uses(context, node, binding):
                section = KIND_OF_NOUN[use.kind].section
                end = servers.get((section, node.full_name, use.name))
                if end is not None:
                    yield _wait_of(node, binding, group, *end, use)


def _waiting_uses(context: CheckContext, node: NodeSpec, binding: Binding) -> list[NodeUse]:
    """Return where a behaviour waits, each name once."""
    found = {
        (use.kind, use.name, use.waits): use
        for use in reversed(context.behaviours.read(node, binding).uses)
        if use.waits
    }
    return [found[key] for key in sorted(found)]


def _wait_of(
    node: NodeSpec,
    binding: Binding,
    group: Group | None,
    channel: Channel,
    client: Endpoint,
    use: NodeUse,
) -> _Wait:
    server = channel.providers[0]
    what = f"{channel.kind} '{channel.name}'"
    part = 'accept' if channel.kind == 'action' and use.waits == 'answer' else 'behaviour'
    return _Wait(
        node,
        binding,
        group,
        channel.name,
        f'the end of a goal of {what}' if use.waits == 'end' else what,
        client,
        server,
        use.place,
        answering=(*server.path, part),
        answering_group=_need(server, use.waits),
    )


def _need(server: Endpoint, waited: Waited) -> Group | None:
    """Return the group that an answer needs."""
    if not isinstance(server.node, NodeSpec):
        return None
    if isinstance(server.entity, ActionSpec):
        if waited == 'answer':
            return server.node.full_name, _ACCEPTING
        return _queue_of(server.node, server.entity)
    return _group_of(server.node, getattr(server.entity, 'group', None))


def group_in(node: NodeSpec, binding: Binding) -> Group | None:
    """Return the mutually exclusive group that a behaviour runs in, if there is one."""
    if isinstance(binding.entity, ActionSpec):
        if binding.key.key == 'accept':
            return node.full_name, _ACCEPTING
        return _queue_of(node, binding.entity)
    if isinstance(binding.entity, ActionClientSpec):
        return _group_of(node, None)
    if binding.kind is None or not binding.kind.has_group:
        return None
    return _group_of(node, getattr(binding.entity, 'group', None))


def _queue_of(node: NodeSpec, action: ActionSpec) -> Group | None:
    """Return what only one goal of an action has at a time."""
    return (node.full_name, f'goals of {action.name}') if action.concurrency == 'queue' else None


def _group_of(node: NodeSpec, name: str | None) -> Group | None:
    return None if name == REENTRANT else (node.full_name, name or '')


def _check_hooks(context: CheckContext, waits: list[_Wait]) -> Iterator[Diagnostic]:
    """Check calls in hooks: services and actions answer only between `on_start` and `on_stop`."""
    in_hooks = [wait for wait in waits if wait.binding.kind is None]
    starts = StartOrder(context) if in_hooks else None
    for wait in in_hooks:
        hook, server = wait.binding.owner, wait.server.node
        is_own = server is wait.node
        if not isinstance(server, NodeSpec):
            continue
        if hook == 'on_start' and starts and (is_own or starts.is_later(server, wait.node)):
            part = 'on_start' if server.on_start else 'start'
            when = f"after the {part} of node '{server.name}'"
        elif hook == 'on_stop' and is_own:
            when = 'until on_stop'
        elif hook in TRANSITION_BEHAVIOURS and is_own:
            when = 'while the node is active'
        else:
            continue
        help_text = 'put that node before this one'
        if wait.node.starts_late or server.starts_late:
            key = 'delay' if server.delay_sec and not server.wait_for else 'wait_for'
            help_text = f"'{server.name}' has '{key}', and starts after '{wait.node.name}'"
        yield context.at_value(
            wait.path,
            _RULE,
            f'{wait} waits for {wait.what}, which answers only {when}',
            help=_HOOK_HELP.get(hook) if is_own else help_text,
            related=_places(context, [wait]),
        )


_HOOK_HELP = {
    'on_start': 'call it in a timer, which runs when all nodes have started',
    **dict.fromkeys(
        ('on_stop', *TRANSITION_BEHAVIOURS), 'call what the service does as a plain function'
    ),
}


def _check_groups(context: CheckContext, waits: list[_Wait]) -> Iterator[Diagnostic]:
    """Check that no chain of calls returns to the group that its first behaviour blocks."""
    first_of: dict[DataPath, _Wait] = {}
    calls: dict[DataPath, list[DataPath]] = {}
    for wait in waits:
        first_of.setdefault(wait.path, wait)
        calls.setdefault(wait.path, []).append(wait.answering)
    served: dict[Group | None, set[DataPath]] = {}
    for wait in waits:
        served.setdefault(wait.answering_group, set()).add(wait.answering)
    by_pair = {(wait.path, wait.answering): wait for wait in waits}
    for knot in find_knots(_with_groups(waits, calls)):
        done: set[object] = set()
        for path in [path for path in first_of if path in knot and path not in done]:
            if path in done:
                continue
            group = first_of[path].group
            way = find_way(calls, path, served.get(group, ()), knot) if group else None
            if way:
                # Round a ring of services every one of them would be a beginning.
                done |= set(way) if way[0] == way[-1] else {path}
                chain = [by_pair[pair] for pair in pairwise(way)]
                yield _explain(context, chain)


def _with_groups(
    waits: list[_Wait], calls: dict[DataPath, list[DataPath]]
) -> dict[Hashable, list[Hashable]]:
    """Return the calls, with the edges from a server to all that wait in its group.

    Only what lies on a cycle of these can be a deadlock.
    """
    edges: dict[Hashable, list[Hashable]] = {path: [*called] for path, called in calls.items()}
    for wait in waits:
        if wait.answering_group:
            edges.setdefault(wait.answering, []).append(wait.answering_group)
        if wait.group:
            edges.setdefault(wait.group, []).append(wait.path)
    return edges


def _explain(context: CheckContext, chain: list[_Wait]) -> Diagnostic:
    first, last = chain[0], chain[-1]
    kind = last.server.kind
    if len(chain) == 1 and kind.has_group:
        message = (
            f'{first} waits for {first.what}, which its own callback group serves: '
            'neither can continue'
        )
    elif len(chain) == 1:
        message = f'{first} waits for {first.what}, which waits for it: neither can continue'
    else:
        names = [f"'{wait.name}'" for wait in chain]
        if len(names) > _MOST_SHOWN:
            names[_MOST_SHOWN - 1 : -1] = ['…']
        way = ' → '.join(names)
        message = (
            f'{first} waits for a chain of {_kinds_in(chain)} that comes back to its own '
            f'callback group, so none can continue: {way}'
        )
    return context.at_value(
        first.path,
        _RULE,
        message,
        part=first.binding.behaviour.function,
        help=_help_for(last),
        related=_places(context, chain[:_MOST_SHOWN]),
    )


def _places(context: CheckContext, chain: list[_Wait]) -> list[Related]:
    return [
        place
        for wait in chain
        for place in (
            Related(f"'{wait.binding.behaviour.function}' waits here", wait.place),
            context.related(wait.server.path, f"'{wait.name}' is served here"),
            context.related(wait.client.path, f"node '{wait.node.name}' calls it by this name"),
        )
    ]


def _help_for(last: _Wait) -> str:
    """Return what to do about the last wait of a chain."""
    server = last.server
    if server.kind.has_group:
        name = f"{server.kind.noun} '{server.entity.name}'"
        return f"give {name} a group of its own, or 'group: reentrant'"
    if last.answering[-1] == 'accept':
        return 'send the goal in a timer, or in the behaviour of the action'
    return "write 'concurrency: parallel' at the action, or do not wait for the goal"


def _kinds_in(chain: list[_Wait]) -> str:
    """Return `services`, `actions`, or both."""
    return ' and '.join(sorted({f'{wait.server.kind.channel}s' for wait in chain}, reverse=True))
