"""Check what only a node with a lifecycle has, and states that are waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

from composer.checks.connections.wait_conditions import waiters
from composer.entity_kinds import TRANSITION_BEHAVIOURS
from composer.language.specs import LifecycleState, ProcessState
from composer.names import expand_name, with_article
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec

_RULE = 'no-lifecycle'
_HELP = "write 'lifecycle: true' in the node"
_STATES: dict[str, tuple[str, ...]] = {
    'node': get_args(LifecycleState),
    'process': get_args(ProcessState),
}
_WITHOUT_EFFECT = 'has no effect'


def check_lifecycles(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that nodes have the lifecycle that they need for what they say."""
    for node in context.spec.nodes.values():
        if node.lifecycle is None and not context.was_dropped((*node.path, 'lifecycle')):
            yield from _check_without(context, node)


def check_awaited_states(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that who waits for a state waits for a node that has one."""
    for process in context.spec.processes.values():
        is_known = process.node_name or any(each.is_named for each in process.nodes)
        is_dropped = context.was_dropped((*process.path, 'nodes'))
        if process.lifecycle and not (is_known or is_dropped):
            yield context.at_key(
                (*process.path, 'lifecycle'),
                'missing-key',
                f"'lifecycle' of process '{process.name}' needs the names of its nodes",
                help="write 'name: …', or 'nodes: […]'",
            )
    by_name = {node.full_name: node for node in context.spec.nodes.values()}
    for waiter in waiters(context.spec):
        for condition in waiter.wait_for:
            if condition.state is None:
                continue
            states = _STATES.get(condition.kind, ())
            at = (*condition.path[:-1], 'state')
            if condition.state not in states:
                what = with_article(condition.kind)
                yield context.at_value(
                    at,
                    'bad-value',
                    f"'{condition.state}' is no state of {what}",
                    help=suggest(condition.state, states, 'it may be')
                    or f'leave it out: {what} is there or not',
                )
            if condition.kind != 'node':
                continue
            name = expand_name(condition.name, waiter.name, waiter.namespace or '/')
            node = by_name.get(name)
            if node and not node.lifecycle and not context.was_dropped((*node.path, 'lifecycle')):
                yield context.at_value(
                    at,
                    _RULE,
                    f"node '{node.name}' has no lifecycle, and is never {condition.state}",
                    help=f"{_HELP} '{node.name}', or leave the state out",
                    related=[context.related(node.path, 'the node is declared here')],
                )


def _check_without(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    for key in TRANSITION_BEHAVIOURS:
        if getattr(node, key) is not None:
            what = 'is never called'
            yield _finding(context, node, key, what)
    if node.bond:
        yield _finding(context, node, 'bond', _WITHOUT_EFFECT)
    for section in ('subscriptions', 'services'):
        for entity in getattr(node, section).values():
            if entity.while_inactive is not None:
                path = (*entity.path, 'while_inactive')
                yield _finding(context, node, 'while_inactive', _WITHOUT_EFFECT, path)


def _finding(
    context: CheckContext,
    node: NodeSpec,
    key: str,
    what: str,
    path: tuple[str | int, ...] = (),
) -> Diagnostic:
    text = f"'{key}' {what}: node '{node.name}' has no lifecycle"
    return context.at_key(path or (*node.path, key), _RULE, text, help=_HELP)
