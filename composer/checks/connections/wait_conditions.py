"""Check `wait_for` and `on_exit`: conditions can come true, and nothing waits for itself."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name
from composer.names import (
    expand_name,
    find_namespace_problem,
    find_node_name_problem,
    find_topic_name_problem,
    with_article,
)
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.language.specs import (
        ComponentSpec,
        ConditionSpec,
        DeclaredNodeSpec,
        NodeSpec,
        ProcessSpec,
        SystemSpec,
    )
    from composer.yaml_text.positions import DataPath


def check_waits(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that conditions can come true, and that nothing waits for itself."""
    for waiter in waiters(context.spec):
        for condition in waiter.wait_for:
            yield from _check_name(context, waiter, condition)
            if condition.kind == 'process':
                yield from _check_process(context, condition.name, condition.path)
            yield from _check_end(context, condition)
    for name, places in _find_starters(context.spec).items():
        for place, _ in places:
            yield from _check_process(context, name, place)
    yield from _find_cycles(context)


def _check_process(context: CheckContext, name: str, path: DataPath) -> Iterator[Diagnostic]:
    """Check that there is a process of the name that is written at a path."""
    spec = context.spec
    lost = context.was_dropped(('processes',)) or context.was_dropped(('processes', name))
    if name in spec.processes or lost:
        if name in spec.processes and spec.processes[name].external:
            container = spec.processes[name].full_name
            message = f"'{name}' runs elsewhere, and nothing is known of its process"
            use = f'write {{node: {container}}} to wait for it'
            yield context.at_value(path, 'unknown-process', message, help=use)
        return
    advice = suggest(name, spec.processes, 'there are')
    if name in spec.nodes:
        is_start = path[-1] == 'start'
        use = 'it starts by itself' if is_start else f'write {{node: {name}}} to wait for it'
        advice = f"'{name}' is a node: {use}"
    message = f"there is no process '{name}' in this system"
    yield context.at_value(path, 'unknown-process', message, help=advice)


def _check_end(context: CheckContext, condition: ConditionSpec) -> Iterator[Diagnostic]:
    """Check that a process ends whose end is waited for."""
    process = context.spec.processes.get(condition.name) if condition.kind == 'process' else None
    if process is None or condition.state not in ('ended', 'succeeded'):
        return
    if process.restart == 'always' and process.most_restarts is None:
        yield context.at_value(
            (*condition.path[:-1], 'state'),
            'never-ends',
            f"'{process.name}' never ends: it is restarted whenever it does",
            help="limit its restarts with 'max', or restart it 'on_failure' alone",
            related=[context.related((*process.path, 'restart'), 'it is restarted here')],
        )


def waiters(spec: SystemSpec) -> Iterable[NodeSpec | ProcessSpec | ComponentSpec]:
    """Return all nodes, processes and components; each may wait for something."""
    return (*spec.nodes.values(), *spec.processes.values(), *spec.components)


def _check_name(
    context: CheckContext, waiter: NodeSpec | ProcessSpec | ComponentSpec, condition: ConditionSpec
) -> Iterator[Diagnostic]:
    """Check that the name of a condition is one that ROS allows."""
    kind, name = condition.kind, condition.name
    problem: str | None = None
    if kind == 'node':
        namespace, _, last = expand_name(name, waiter.name, waiter.namespace or '/').rpartition(
            '/'
        )
        own = waiter.namespace or '/'
        is_own_wrong = not name.startswith('/') and find_namespace_problem(own) is not None
        in_namespace = namespace and not is_own_wrong and find_namespace_problem(namespace)
        problem = find_node_name_problem(last) or in_namespace or None
    elif kind != 'process':
        problem = find_topic_name_problem(name, kind)
    if problem:
        message = f"'{name}' cannot be the name of {with_article(kind)}: {problem}"
        yield context.at_value(condition.path, 'bad-name', message)


def _find_cycles(context: CheckContext) -> Iterator[Diagnostic]:
    """Yield one finding for each cycle of nodes and processes that wait for each other."""
    edges = _find_waits(context)
    done: set[tuple[str | int, ...]] = set()
    for start, first in edges.items():
        trail: list[tuple[str | int, ...]] = []
        pending = [(start, iter(first))] if start not in done else []
        while pending:
            path, others = pending[-1]
            if path not in trail:
                trail.append(path)
            place, target = next(others, (None, None))
            if place is None or target is None:
                done.add(path)
                trail.remove(path)
                pending.pop()
            elif target in trail:
                cycle = trail[trail.index(target) :]
                names = [str(each[-1]) for each in cycle]
                way = ' → '.join([*names, names[0]])
                message = f'{way}: these wait for each other, and none of them ever starts'
                advice = None
                if len(cycle) == 1 and place[-1] == 'start':
                    message = f"'{names[0]}' only starts when it has ended, so it never does"
                    advice = 'to start it again whenever it ends: restart: {when: always}'
                related = [
                    context.related_value(each, f"'{waiter[-1]}' waits here")
                    for waiter, awaited in pairwise(cycle)
                    for each, path in edges[waiter]
                    if path == awaited
                ]
                yield context.at_value(place, 'wait-cycle', message, related=related, help=advice)
            elif target not in done:
                pending.append((target, iter(edges.get(target, ()))))


def _find_waits(context: CheckContext) -> dict[DataPath, list[tuple[DataPath, DataPath]]]:
    """Return what starts after what: for each waiter, where that is said, and for whom."""
    providers = _Providers(context)
    edges = {
        waiter.path: [
            (condition.path, path)
            for condition in waiter.wait_for
            for path in providers.of(waiter, condition)
        ]
        for waiter in waiters(context.spec)
    }
    for name, places in _find_starters(context.spec).items():
        # Of several, any one will do.
        if len(places) == 1 and (process := context.spec.processes.get(name)):
            edges[process.path].append(places[0])
    for component in context.spec.components:
        edges[component.path].append((component.path, component.path[:2]))
    return edges


def _find_starters(spec: SystemSpec) -> dict[str, list[tuple[DataPath, DataPath]]]:
    """Return which processes are started by the ends of others: where that is said, by whom."""
    starters: dict[str, list[tuple[DataPath, DataPath]]] = {}
    for process in spec.processes.values():
        for action in process.on_exit:
            if action.start is not None:
                place = (*action.path, 'start')
                starters.setdefault(action.start, []).append((place, process.path))
    return starters


class StartOrder:
    """Which nodes start after which: those with conditions after all those without."""

    def __init__(self, context: CheckContext) -> None:
        self._context = context
        self._order = {name: index for index, name in enumerate(context.spec.nodes)}
        self._providers = _Providers(context)

    def is_later(self, node: NodeSpec, other: NodeSpec) -> bool:
        """Return whether a node is sure to serve nothing before the `on_start` of another ends."""
        if not other.starts_late:
            if node.starts_late:
                return True
            return node.on_start is not None and self._order[node.key] > self._order[other.key]
        return bool(node.wait_for) and self._waits_for(node, other)

    def _waits_for(self, node: NodeSpec, other: NodeSpec) -> bool:
        by_path = {each.path: each for each in waiters(self._context.spec)}
        pending: list[DataPath] = [node.path]
        seen: set[DataPath] = set()
        while pending:
            path = pending.pop()
            if path == other.path:
                return True
            if path not in seen:
                seen.add(path)
                waiter = by_path[path]
                for condition in waiter.wait_for:
                    pending += self._providers.of(waiter, condition)
        return False


class _Providers:
    """The nodes and processes that provide what others wait for."""

    def __init__(self, context: CheckContext) -> None:
        self._spec = context.spec
        self._nodes = {node.full_name: node.path for node in context.spec.nodes.values()}
        self._channels: dict[tuple[str, str], list[tuple[str | int, ...]]] = {}
        for node in context.spec.nodes.values():
            for publisher in node.publishers.values():
                self._add(node, 'topic', publisher.topic)
            for service in node.services.values():
                self._add(node, 'service', service.service)
            for action in node.actions.values():
                self._add(node, 'action', action.action)
        for process in context.spec.processes.values():
            for declared in process.nodes:
                if declared.is_named:
                    is_component = declared.path[-2:-1] == ('components',)
                    path = declared.path if is_component else process.path
                    self._nodes.setdefault(declared.full_name, path)
                for kind, end in declared.ends():
                    if kind.provides and kind.channel:
                        self._add(declared, kind.channel, end.channel, process.path)

    def of(
        self, waiter: NodeSpec | ProcessSpec | ComponentSpec, condition: ConditionSpec
    ) -> list[tuple[str | int, ...]]:
        """Return the path of the only provider of a condition; nothing if there are several."""
        kind = condition.kind
        if kind == 'process':
            process = self._spec.processes.get(condition.name)
            return [process.path] if process else []
        if kind == 'node':
            name = expand_name(condition.name, waiter.name, waiter.namespace or '/')
            path = self._nodes.get(name)
            return [path] if path else []
        found = self._channels.get((kind, full_name(waiter, kind, condition.name)), [])
        # Of several, any one will do.
        return found if len(found) == 1 else []

    def _add(
        self,
        node: NodeSpec | DeclaredNodeSpec,
        kind: ChannelKind,
        name: str,
        provider: DataPath | None = None,
    ) -> None:
        found = self._channels.setdefault((kind, full_name(node, kind, name)), [])
        found.append(provider or node.path)
