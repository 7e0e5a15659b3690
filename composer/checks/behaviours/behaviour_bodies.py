"""What behaviours do with messages, their node and its state can be done."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.diagnostics import Related, diagnostic_at
from composer.language.bindings import node_bindings
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.inference.reading import Reading
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec

Readings = list[tuple['Binding', 'Reading']]


def bound_at(context: CheckContext, binding: Binding) -> Related:
    """Return where the file names a behaviour, as another place of a finding."""
    return context.related_value(binding.behaviour.path, f'{binding.owner} is bound to it here')


def check_bodies(context: CheckContext) -> Iterator[Diagnostic]:
    """Behaviours use fields, attributes and names of `node.state` that exist; each place once."""
    found: dict[tuple[Span, str], Diagnostic] = {}
    for node in context.spec.nodes.values():
        readings = [
            (binding, context.behaviours.read(node, binding))
            for binding in node_bindings(node)
            if not context.was_dropped(binding.behaviour.path)
        ]
        for finding in (
            *_explain_problems(context, readings),
            *_check_state(context, node, readings),
            *_check_parameters_set(context, node, readings),
        ):
            if finding.span is not None:
                found.setdefault((finding.span, finding.rule), finding)
    yield from found.values()


def _explain_problems(context: CheckContext, readings: Readings) -> Iterator[Diagnostic]:
    for binding, reading in readings:
        for each in reading.problems:
            yield diagnostic_at(
                each.place,
                each.rule,
                each.message,
                help=each.help,
                related=[bound_at(context, binding)],
            )


def _check_state(
    context: CheckContext, node: NodeSpec, readings: Readings
) -> Iterator[Diagnostic]:
    """Check the names of `node.state` that are read: something has to set them."""
    if any(reading.is_state_open for _, reading in readings):
        return
    if context.was_dropped((*node.path, 'state')):
        return
    known = set(node.state).union(*(reading.state_set for _, reading in readings))
    tested = set().union(*(reading.state_tested for _, reading in readings))
    for binding, reading in readings:
        for use in reading.state_read:
            if use.name in known or use.name in tested:
                continue
            if use.is_guarded and find_nearest(use.name, known) is None:
                continue
            yield diagnostic_at(
                use.place,
                'unknown-state',
                f"neither 'state:' of node '{node.name}' nor a behaviour sets '{use.name}'",
                help=suggest(use.name, known, 'there are', "declare it under 'state:'"),
                related=[bound_at(context, binding)],
            )


def _check_parameters_set(
    context: CheckContext, node: NodeSpec, readings: Readings
) -> Iterator[Diagnostic]:
    """Check the parameters that are set by name, of nodes of this system."""
    for binding, reading in readings:
        for each in reading.parameters_set:
            target = _node_of_name(context, node, each.node)
            if target is None or each.name in target.parameters:
                continue
            if _may_have_others(context, target):
                continue
            yield diagnostic_at(
                each.place,
                'unknown-parameter',
                f"node '{target.name}' declares no parameter '{each.name}'",
                help=suggest(each.name, target.parameters, 'it declares'),
                related=[bound_at(context, binding)],
            )


def _node_of_name(context: CheckContext, node: NodeSpec, name: str) -> NodeSpec | None:
    """Return the node that a name means, as `node.set_parameters` takes it."""
    within = node.full_name.rpartition('/')[0]
    full_name = name if name.startswith('/') else f'{within}/{name}'
    nodes = context.spec.nodes.values()
    return next((each for each in nodes if each.full_name == full_name), None)


def _may_have_others(context: CheckContext, node: NodeSpec) -> bool:
    return any(
        context.behaviours.read(node, binding).reaches_ros for binding in node_bindings(node)
    )
