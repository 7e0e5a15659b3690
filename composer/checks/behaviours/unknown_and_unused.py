"""What behaviours use of their node and what the node declares: each is one of the other."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

from composer.diagnostics import Related
from composer.language.bindings import node_bindings
from composer.language.specs import NodeSpec
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.python_source.behaviour_uses import BehaviourUses, FoundUse
    from composer.python_source.uses import UseKind
    from composer.yaml_text.positions import DataPath

_SECTIONS: dict[UseKind, str] = {
    'publisher': 'publishers',
    'service client': 'service_clients',
    'action client': 'action_clients',
    'parameter': 'parameters',
}
_UNKNOWN: dict[UseKind, str] = {
    'publisher': 'unknown-publisher',
    'service client': 'unknown-service-client',
    'action client': 'unknown-action-client',
    'parameter': 'unknown-parameter',
}
_UNUSED: dict[UseKind, tuple[str, str]] = {
    'publisher': ('unused-publisher', 'nothing publishes on it'),
    'service client': ('unused-service-client', 'no behaviour of the node calls it'),
    'action client': ('unused-action-client', 'no behaviour of the node sends it a goal'),
    'parameter': ('unused-parameter', 'no behaviour of the node reads it'),
}
# Parameters that every node of rclpy declares.
_OF_EVERY_NODE = {'use_sim_time', 'start_type_description_service'}
# Parameters that rclpy itself reads.
_OF_ROS = 'qos_overrides.'
# Where behaviours, and `publish:`, stand.
_USING_SECTIONS = {'timers', 'subscriptions', 'services', 'actions', 'action_clients'}
_USING_KEYS = {'behaviour', 'publish', 'accept', 'feedback', 'result'}
_KEYS_OF_NODES = {each.name for each in fields(NodeSpec)}
_HOOKS = {'on_start', 'on_stop', 'on_parameters'}
_ENTITY_DEPTH = 2


def check_uses(context: CheckContext) -> Iterator[Diagnostic]:
    """Behaviours use what their node declares, and all that is declared is used."""
    lost = _lost_by_node(context)
    uses = {
        name: [(binding, context.uses.uses_of(binding)) for binding in _bindings(context, node)]
        for name, node in context.spec.nodes.items()
    }
    for name, node in context.spec.nodes.items():
        # Parameters may be declared with rclpy, too.
        is_open = any(found.reaches_ros for _, found in uses[name])
        for binding, found in uses[name]:
            told = _without_parameters(found) if is_open else found
            yield from _check_names(context, node, binding, told, lost.get(name, []))
    whole = [
        (node, [found for _, found in uses[name]])
        for name, node in context.spec.nodes.items()
        if not any(_may_hide_a_use(path) for path in lost.get(name, []))
    ]
    yield from _check_unused(context, whole)


def _without_parameters(uses: BehaviourUses) -> BehaviourUses:
    kept = tuple(each for each in uses.found if each.use.kind != 'parameter')
    return replace(uses, found=kept)


def _bindings(context: CheckContext, node: NodeSpec) -> list[Binding]:
    bindings = node_bindings(node)
    return [each for each in bindings if not context.was_dropped(each.behaviour.path)]


def _lost_by_node(context: CheckContext) -> dict[str, list[DataPath]]:
    """Return what was left out of each node for its own faults, by paths within the node."""
    lost: dict[str, list[DataPath]] = {}
    for path in context.system.dropped:
        if path[:1] == ('nodes',) and len(path) > 1:
            lost.setdefault(str(path[1]), []).append(path[2:])
    return lost


def _check_names(
    context: CheckContext,
    node: NodeSpec,
    binding: Binding,
    uses: BehaviourUses,
    lost: list[DataPath],
) -> Iterator[Diagnostic]:
    reported: set[tuple[UseKind, str]] = set()
    for found in uses.found:
        use = found.use
        key = (use.kind, use.name)
        if key in reported or not use.is_certain or use.is_guarded or use.has_default:
            continue
        if not _is_declared(node, use.kind, use.name, lost):
            reported.add(key)
            yield _explain_name(context, node, binding, found)


def _is_declared(node: NodeSpec, kind: UseKind, name: str, lost: list[DataPath]) -> bool:
    """Return whether a node declares something, or may do so under a faulty key."""
    section = _SECTIONS[kind]
    if name in getattr(node, section) or (kind == 'parameter' and name in _OF_EVERY_NODE):
        return True
    return any(path in ((section,), (section, name)) or _is_unknown(path) for path in lost)


def _is_unknown(path: DataPath) -> bool:
    """Return whether a path within a node is that of an unknown key, a section misspelt say."""
    return len(path) == 1 and path[0] not in _KEYS_OF_NODES


def _explain_name(
    context: CheckContext, node: NodeSpec, binding: Binding, found: FoundUse
) -> Diagnostic:
    use, behaviour = found.use, binding.behaviour
    section = _SECTIONS[use.kind]
    declares_not = f"node '{node.name}' declares no {use.kind} '{use.name}'"
    rule = _UNKNOWN[use.kind]
    message = f"{declares_not}, which '{behaviour.function}' uses"
    if use.is_optional:
        rule = 'missing-parameter'
        message = f"{declares_not}, and '{behaviour.function}' gets None for it"
    return context.at_value(
        behaviour.path,
        rule,
        message,
        part=behaviour.function,
        help=suggest(
            use.name, getattr(node, section), 'it declares', f"declare it under '{section}:'"
        ),
        related=[Related(f"'{use.name}' is used here", found.place)],
    )


def _check_unused(
    context: CheckContext, nodes: list[tuple[NodeSpec, list[BehaviourUses]]]
) -> Iterator[Diagnostic]:
    """Warn of what nobody uses; what nodes share in the file is used if one of them uses it."""
    are_read = any(each.reads_others for _, uses in nodes for each in uses)
    unused: dict[Span, Diagnostic] = {}
    used: set[Span] = set()
    for node, uses in nodes:
        open_kinds = _open_kinds(node, uses, are_read=are_read)
        names = {(found.use.kind, found.use.name) for each in uses for found in each.found}
        names |= {('publisher', trigger.publish or '') for trigger in node.triggers}
        names |= set(_meant(node, names))
        for kind, section in _SECTIONS.items():
            for name, entity in getattr(node, section).items():
                span = context.system.positions.key(entity.path)
                if kind in open_kinds or (kind, name) in names or _is_of_ros(kind, name):
                    used.add(span)
                elif span not in unused:
                    unused[span] = _explain_unused(context, kind, name, entity.path)
    yield from (finding for span, finding in unused.items() if span not in used)


def _meant(node: NodeSpec, used: set[tuple[UseKind, str]]) -> Iterator[tuple[UseKind, str]]:
    """Yield what was meant by names that the node does not declare, all of it where none is near.

    That these are not declared is one fault; that what they mean is not used, no other one.
    """
    for kind, name in used:
        declared = getattr(node, _SECTIONS[kind])
        if name and name not in declared and not _is_of_ros(kind, name):
            near = find_nearest(name, declared)
            yield from ((kind, each) for each in (declared if near is None else (near,)))


def _open_kinds(
    node: NodeSpec, uses: list[BehaviourUses], *, are_read: bool
) -> frozenset[UseKind]:
    """Return the kinds of what may be used in ways that cannot be told.

    Args:
        are_read: Whether some behaviour reads parameters of other nodes.
    """
    kinds = frozenset(kind for each in uses for kind in each.open_kinds)
    # A behaviour may act on changes alone; and what a node without behaviours has, it has for
    # others.
    is_for_others = are_read or node.on_parameters is not None or not uses
    return kinds | {'parameter'} if is_for_others else kinds


def _explain_unused(context: CheckContext, kind: UseKind, name: str, path: DataPath) -> Diagnostic:
    rule, why = _UNUSED[kind]
    return context.at_key(
        path,
        rule,
        f"{kind} '{name}' is declared, and {why}",
        help='remove it, or use it in a behaviour',
    )


def _is_of_ros(kind: UseKind, name: str) -> bool:
    return kind == 'parameter' and (name in _OF_EVERY_NODE or name.startswith(_OF_ROS))


def _may_hide_a_use(path: DataPath) -> bool:
    """Return whether what is missing at a path within a node may have used something of it."""
    if not path or _is_unknown(path) or path[0] in _HOOKS:
        return True
    is_whole = len(path) <= _ENTITY_DEPTH
    return path[0] in _USING_SECTIONS and (is_whole or path[-1] in _USING_KEYS)
