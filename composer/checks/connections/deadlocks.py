"""Deadlocks: behaviours that wait for something that can run only after them.

A callback of a mutually exclusive group keeps the whole group until it returns; a coroutine keeps
it until it ends, also while it awaits (rclpy's executors and Composer's). Composer's `node.call`
gives up its thread while it waits, so there are never too few threads for those who wait.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from composer.checks.connections.cycles import find_knots, find_way
from composer.diagnostics import Related
from composer.language.bindings import node_bindings
from composer.language.specs import REENTRANT
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    from composer.checks.connections.topology import Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.yaml_text.positions import DataPath

# Of a chain of calls, how many are named.
_MOST_SHOWN = 8

# A callback group: the node's name and the group's own.
Group = tuple[str, str]


@record
class _Wait:
    """A behaviour waits for a service.

    Attributes:
        group: The group that it keeps meanwhile, `None` for none.
        client: The end that it calls through.
        server: The end that would answer.
        place: Where the behaviour waits.
        answering: The behaviour that would, by its path.
        answering_group: The group that it needs, `None` for none.
    """

    node: NodeSpec
    binding: Binding
    group: Group | None
    service: str
    client: Endpoint
    server: Endpoint
    place: Span

    @property
    def path(self) -> DataPath:
        return self.binding.behaviour.path

    @property
    def answering(self) -> DataPath:
        return (*self.server.path, 'behaviour')

    @property
    def answering_group(self) -> Group | None:
        return _group_of(self.server.node, getattr(self.server.entity, 'group', None))

    def __str__(self) -> str:
        return f"{self.binding.owner} of node '{self.node.name}'"


def check_deadlocks(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no behaviour waits for a service that is blocked by the behaviour itself."""
    waits = list(_find_waits(context))
    yield from _check_hooks(context, waits)
    yield from _check_groups(context, waits)


def _find_waits(context: CheckContext) -> Iterator[_Wait]:
    servers = {
        (end.node.name, end.entity.name): (channel, end)
        for channel in context.topology.of_kind('service')
        for end in channel.users
        if len(channel.providers) == 1
    }
    if not servers:
        return
    for node in context.spec.nodes.values():
        for binding in node_bindings(node):
            if context.was_dropped(binding.behaviour.path):
                continue
            waits = {
                use.name: use.place
                for use in reversed(context.behaviours.read(node, binding).uses)
                if use.kind == 'service client' and use.waits and use.is_certain
            }
            for name, place in sorted(waits.items(), key=lambda wait: wait[0]):
                if (node.name, name) in servers:
                    channel, client = servers[node.name, name]
                    group = _group_in(node, binding)
                    server = channel.providers[0]
                    yield _Wait(node, binding, group, channel.name, client, server, place)


def _group_in(node: NodeSpec, binding: Binding) -> Group | None:
    """Return the mutually exclusive group that a behaviour runs in, if there is one."""
    if binding.kind is None or not binding.kind.has_group:
        return None
    return _group_of(node, getattr(binding.entity, 'group', None))


def _group_of(node: NodeSpec, name: str | None) -> Group | None:
    return None if name == REENTRANT else (node.name, name or '')


def _check_hooks(context: CheckContext, waits: list[_Wait]) -> Iterator[Diagnostic]:
    """Check calls in hooks: services answer only between `on_start` and `on_stop`."""
    order = {name: index for index, name in enumerate(context.spec.nodes)}
    for wait in waits:
        hook, server = wait.binding.owner, wait.server.node
        is_own = server is wait.node
        if hook == 'on_start' and (is_own or _starts_later(order, wait)):
            when = f"after the on_start of node '{server.name}'"
        elif hook == 'on_stop' and is_own:
            when = 'until on_stop'
        else:
            continue
        yield context.at_value(
            wait.path,
            'service-deadlock',
            f"{wait} waits for service '{wait.service}', which answers only {when}",
            help=_HOOK_HELP.get(hook) if is_own else 'put that node before this one',
            related=_places(context, [wait]),
        )


_HOOK_HELP = {
    'on_start': 'call it in a timer, which runs when all nodes have started',
    'on_stop': 'call what the service does as a plain function',
}


def _starts_later(order: dict[str, int], wait: _Wait) -> bool:
    server = wait.server.node
    return server.on_start is not None and order[server.name] > order[wait.node.name]


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
    if len(chain) == 1:
        message = (
            f"{first} waits for service '{first.service}', which its own callback group serves: "
            'neither can continue'
        )
    else:
        names = [f"'{wait.service}'" for wait in chain]
        if len(names) > _MOST_SHOWN:
            names[_MOST_SHOWN - 1 : -1] = ['…']
        way = ' → '.join(names)
        message = (
            f'{first} waits for a chain of services that comes back to its own callback group, '
            f'so none can continue: {way}'
        )
    return context.at_value(
        first.path,
        'service-deadlock',
        message,
        part=first.binding.behaviour.function,
        help=f"give {last.server.kind.noun} '{last.server.entity.name}' a group of its own, "
        "or 'group: reentrant'",
        related=_places(context, chain[:_MOST_SHOWN]),
    )


def _places(context: CheckContext, chain: list[_Wait]) -> list[Related]:
    return [
        place
        for wait in chain
        for place in (
            Related(f"'{wait.binding.behaviour.function}' waits here", wait.place),
            context.related(wait.server.path, f"'{wait.service}' is served here"),
            context.related(wait.client.path, f"node '{wait.node.name}' calls it by this name"),
        )
    ]
