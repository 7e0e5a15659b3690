"""Remapping rules that match nothing: ROS ignores them without a word.

A rule may be for what a behaviour makes with rclpy itself, or for what a program has that does not
say all of it: then only a name that is all but one of its own is reported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.ament import remaps_actions
from composer.checks.connections.topology import TOPICS_OF_ROS
from composer.checks.connections.typos import as_written, at_the_top, find_typo
from composer.names import expand_name, find_topic_name_problem
from composer.spelling import did_you_mean, find_nearest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.specs import (
        ActionClientSpec,
        ActionSpec,
        DeclaredNodeSpec,
        NodeSpec,
        ProcessSpec,
    )
    from composer.yaml_text.positions import DataPath

_RULE = 'likely-misspelling'
# Of a rule: it matches something, it may, or why it does not.
_Verdict: TypeAlias = 'bool | Diagnostic'


def check_remap_rules(context: CheckContext) -> Iterator[Diagnostic]:
    """Check remapping rules: one of an include applies to all that is in it."""
    matching: set[Span] = set()
    # As `composer show` writes a rule of an include: into each of its nodes.
    matching_rules: set[tuple[str, str]] = set()
    found: dict[Span, tuple[tuple[str, str], Diagnostic]] = {}

    def note(path: DataPath, rule: tuple[str, str], verdict: _Verdict) -> None:
        span = context.system.positions.key((*path, 'remap', rule[0]))
        if not isinstance(verdict, bool):
            found.setdefault(span, (rule, verdict))
            return
        matching.add(span)
        if verdict:
            matching_rules.add(rule)

    for node in _all_nodes(context):
        for rule, verdict in _check_node(context, node):
            note(node.path, rule, verdict)
    for process in context.spec.processes.values():
        for path, rule, verdict in _check_process(context, process):
            note(path, rule, verdict)
    for span, (rule, finding) in found.items():
        if span not in matching and rule not in matching_rules:
            yield finding


def _check_node(
    context: CheckContext, node: NodeSpec
) -> Iterator[tuple[tuple[str, str], _Verdict]]:
    """Yield the rules of a node, each with its verdict."""
    if not node.remap:
        return
    names, actions = _names_of(node), _actions_of(node)
    is_known = not _may_have_more(context, node)
    for rule in node.remap:
        path = (*node.path, 'remap', rule[0])
        bare = rule[0].rpartition('://')[2]
        if not _is_rule(rule[0]):
            continue  # which is a finding of its own
        name = expand_name(bare, node.name, node.namespace)
        if name in names or (name in actions and remaps_actions() is not False):
            yield rule, True
        elif name in actions:
            yield rule, _explain_action(context, path, actions[name], name)
        elif find_typo(name, names) or (is_known and not _is_of_ros(context, name)):
            help_text = did_you_mean(_find_meant(bare, name, names, node.namespace))
            yield rule, _explain_rule(context, path, node, name, help_text)
        else:
            yield rule, False


def _check_process(
    context: CheckContext, process: ProcessSpec
) -> Iterator[tuple[DataPath, tuple[str, str], _Verdict]]:
    """Yield the rules of a process and of its components, each with its owner and verdict."""
    components = [node for node in process.nodes if node.path[-2:-1] == ('components',)]
    others = [node for node in process.nodes if node not in components]
    title = f"process '{process.name}'"
    is_open = not process.declares_all_ends or bool(components)
    yield from _check_declared(
        context, title, process.path, others, process.remap, is_open=is_open
    )
    for node in components:
        title = f"component '{node.name}'"
        is_open = node.sections is None
        yield from _check_declared(context, title, node.path, [node], node.remap, is_open=is_open)


def _check_declared(
    context: CheckContext,
    title: str,
    path: DataPath,
    nodes: Sequence[DeclaredNodeSpec],
    rules: Sequence[tuple[str, str]],
    *,
    is_open: bool,
) -> Iterator[tuple[DataPath, tuple[str, str], _Verdict]]:
    """Yield rules for declared nodes with their verdicts.

    Args:
        path: That of the owner of the rules.
        is_open: Whether the nodes may have more than is declared.
    """
    names = {
        expand_name(end.channel, node.name, node.namespace)
        for node in nodes
        for _, end in node.ends()
    }
    for rule in rules:
        bare = rule[0].rpartition('://')[2]
        if not _is_rule(rule[0]):
            continue
        meant = {expand_name(bare, node.name, node.namespace) for node in nodes}
        if meant & names:
            yield path, rule, True
            continue
        is_for_ros = any(_is_of_ros(context, name) for name in meant)
        if is_open or is_for_ros or not meant or _may_mean_more(nodes, bare):
            yield path, rule, False
            continue
        name = min(meant)
        message = f"{title} has nothing called '{name}', and ROS ignores the rule"
        help_text = did_you_mean(_find_meant(bare, name, names, nodes[0].namespace))
        at = (*path, 'remap', rule[0])
        yield path, rule, context.at_key(at, _RULE, message, help=help_text)


def _may_mean_more(nodes: Sequence[DeclaredNodeSpec], source: str) -> bool:
    """Return whether nobody knows all names that nodes have."""
    nameless = [node for node in nodes if not node.is_named]
    private = (end.channel.startswith('~') for node in nameless for _, end in node.ends())
    return any(private) or (bool(nameless) and source.startswith('~'))


def _find_meant(bare: str, name: str, names: set[str], namespace: str) -> str | None:
    """Return the name that a rule may mean, as the rule would write it."""
    if near := find_typo(name, names):
        return as_written(bare, near, namespace)
    written = [as_written(bare, each, namespace) for each in names]
    return at_the_top(bare, names) or find_nearest(bare, written)


def _is_rule(source: str) -> bool:
    """Return whether a rule is one of a topic or service, and says which."""
    scheme, _, bare = source.rpartition('://')
    is_scheme = scheme in ('', 'rostopic', 'rosservice')
    return is_scheme and not (source.startswith('__') or find_topic_name_problem(bare))


def _all_nodes(context: CheckContext) -> Iterator[NodeSpec]:
    """Yield the nodes, also those that are left out this time."""
    yield from context.spec.nodes.values()
    if context.system.unused is not None:
        yield from context.system.unused.nodes.values()


def _may_have_more(context: CheckContext, node: NodeSpec) -> bool:
    """Return whether a node may have topics and services that the file does not show."""
    return node.path in context.incomplete or any(
        each.reaches_ros or each.created for each in context.readings(node)
    )


def _is_of_ros(context: CheckContext, name: str) -> bool:
    """Return whether a rule is for what nodes have from ROS, or often get just in case."""
    is_usual = name.rpartition('/')[2] in ('tf', 'tf_static')
    return is_usual or name in TOPICS_OF_ROS or name in context.topology.ros_services


def _explain_rule(
    context: CheckContext, path: DataPath, node: NodeSpec, name: str, help_text: str | None
) -> Diagnostic:
    message = f"node '{node.name}' has nothing called '{name}', and ROS ignores the rule"
    return context.at_key(path, _RULE, message, help=help_text)


def _explain_action(
    context: CheckContext, path: DataPath, entity: ActionSpec | ActionClientSpec, name: str
) -> Diagnostic:
    return context.at_key(
        path,
        'ignored-remap',
        f"this ROS remaps no actions, such as '{name}', and ignores the rule",
        help=f"give '{entity.name}' its name with 'action:' instead",
    )


def _names_of(node: NodeSpec) -> set[str]:
    """Return the full names of the topics and services of a node."""
    ends = ((kind, end) for kind, end in node.ends() if kind.channel != 'action')
    names = (str(getattr(end, str(kind.channel))) for kind, end in ends)
    return {expand_name(name, node.name, node.namespace) for name in names}


def _actions_of(node: NodeSpec) -> dict[str, ActionSpec | ActionClientSpec]:
    """Return the actions of a node by their full names."""
    ends: list[ActionSpec | ActionClientSpec] = [
        *node.actions.values(),
        *node.action_clients.values(),
    ]
    return {expand_name(end.action, node.name, node.namespace): end for end in ends}
