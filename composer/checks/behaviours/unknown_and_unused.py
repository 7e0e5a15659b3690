"""Behaviours use only what their node declares, and use all of it."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from composer.checks.behaviours.behaviour_bodies import bound_at, readings_of
from composer.checks.behaviours.behaviour_functions import is_called_wrongly
from composer.checks.parameters import OF_EVERY_NODE
from composer.diagnostics import diagnostic_at
from composer.entity_kinds import KIND_OF_NOUN, USED_KINDS
from composer.language.specs import NodeSpec
from composer.node_uses.reading import SENDING_METHODS
from composer.spelling import find_nearest, is_short, is_typo, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.node_uses.reading import NodeUse, Reading
    from composer.yaml_text.positions import DataPath

# Parameters that rclpy itself reads.
_OF_ROS = 'qos_overrides.'
_KEYS_OF_NODES = {each.name for each in fields(NodeSpec)}


def check_uses(context: CheckContext) -> Iterator[Diagnostic]:
    """Behaviours use what their node declares, and use all of it."""
    uses = {name: readings_of(context, node) for name, node in context.spec.nodes.items()}
    lost, unused = _lost_by_node(context), context.system.unused
    yield from _check_names(context, uses, lost)
    yield from _check_choices(context, uses)
    partial = unused.nodes if unused else {}
    whole = [
        (node, [found for _, found in uses[name]])
        for name, node in context.spec.nodes.items()
        # What is left out of a node, or has an error, may use the rest of it.
        if name not in lost
        and partial.get(name, node) is node
        and not _is_broken(context, uses[name])
    ]
    yield from _check_unused(context, whole)


def _is_broken(context: CheckContext, uses: list[tuple[Binding, Reading]]) -> bool:
    """Return whether a behaviour does not have its node."""
    return any(
        is_called_wrongly(context, binding)
        or any(each.message == "'node' is not defined" for each in reading.problems)
        for binding, reading in uses
    )


def _lost_by_node(context: CheckContext) -> dict[str, list[DataPath]]:
    """Return the entries of each node that were dropped for errors, as paths in the node."""
    lost: dict[str, list[DataPath]] = {}
    for path in context.system.dropped:
        if path[:1] == ('nodes',) and len(path) > 1:
            lost.setdefault(str(path[1]), []).append(path[2:])
    return lost


def _check_names(
    context: CheckContext,
    uses: dict[str, list[tuple[Binding, Reading]]],
    lost: dict[str, list[DataPath]],
) -> Iterator[Diagnostic]:
    """Check the names that behaviours use, each place once."""
    declared = _declared_by_behaviour(context, uses)
    found: dict[tuple[Span, str], Diagnostic] = {}
    for name, node in context.spec.nodes.items():
        # A behaviour may declare parameters with rclpy.
        is_open = any(reading.reaches_ros for _, reading in uses[name])
        is_open |= node.has_other_parameters
        created = {(each.kind, each.name) for _, read in uses[name] for each in read.created}
        mentions = context.behaviours.mentions(*(reading for _, reading in uses[name]))
        used = {(use.kind, use.name) for _, reading in uses[name] for use in reading.uses}
        for binding, reading in uses[name]:
            known = declared[binding.behaviour.name]
            sought = {each.name for each in reading.uses if each.is_change and each.has_default}
            for use in reading.uses:
                if use.is_guarded or (is_open and use.kind == 'parameter'):
                    continue
                made = [each for kind, each in created if kind == use.kind]
                made += () if use.kind == 'parameter' else mentions.stored
                if None in made or use.name in made or f'new {use.kind}' in mentions.open_kinds:
                    continue
                if _is_declared(node, use.kind, use.name, lost.get(name, [])):
                    continue
                is_needed = use.is_certain and not use.has_default
                if use.is_change:
                    # ROS only passes on what is declared.
                    is_elsewhere = use.name in sought or (use.kind, use.name) in known
                    is_needed &= not (is_elsewhere or _is_of_ros(use.kind, use.name))
                if not is_needed and not _is_typo(node, use, known, used):
                    continue
                finding = _explain_name(context, node, binding, use)
                key = (use.place, finding.rule)
                before = found.get(key)
                found[key] = before.with_related(finding.related) if before else finding
    yield from found.values()


def _check_choices(
    context: CheckContext, uses: dict[str, list[tuple[Binding, Reading]]]
) -> Iterator[Diagnostic]:
    """Warn of texts with which parameters are compared that no node has among its choices."""
    possible: set[Span] = set()
    found: dict[Span, Diagnostic] = {}
    for key, node in context.spec.nodes.items():
        for binding, reading in uses[key]:
            for name, value, place in reading.compared:
                choices = node.parameters[name].choices if name in node.parameters else None
                if not choices or value in choices:
                    possible.add(place)
                    continue
                text = f"the parameter '{name}' is never '{value}'"
                advice = suggest(value, map(str, choices), 'it is one of')
                related = [bound_at(context, binding)]
                finding = diagnostic_at(place, 'never-equal', text, help=advice, related=related)
                found.setdefault(place, finding)
    yield from (finding for place, finding in found.items() if place not in possible)


def _declared_by_behaviour(
    context: CheckContext, uses: dict[str, list[tuple[Binding, Reading]]]
) -> dict[str, set[tuple[str, str]]]:
    """Return, of each behaviour, what any of the nodes declares that are bound to it."""
    found: dict[str, set[tuple[str, str]]] = {}
    for name, node in context.spec.nodes.items():
        names = {(kind.noun, each) for kind in USED_KINDS for each in getattr(node, kind.section)}
        for binding, _ in uses[name]:
            found.setdefault(binding.behaviour.name, set()).update(names)
    return found


def _is_typo(
    node: NodeSpec, use: NodeUse, declared: set[tuple[str, str]], used: set[tuple[str, str]]
) -> bool:
    """Return whether a name that is used on a condition of the file is wrong in any case."""
    names = getattr(node, KIND_OF_NOUN[use.kind].section)
    near = find_nearest(use.name, names)
    if (use.kind, use.name) in declared:
        return False
    if near is not None and is_typo(use.name, near):
        return True
    # What nobody uses is meant by its longer or shorter form.
    return any(is_short(use.name, each) for each in names if (use.kind, each) not in used)


def _is_declared(node: NodeSpec, kind: str, name: str, lost: list[DataPath]) -> bool:
    """Return whether a node declares something, or may declare it under a misspelt key."""
    section = KIND_OF_NOUN[kind].section
    of_all = OF_EVERY_NODE if kind == 'parameter' else set()
    if name in {*getattr(node, section), *of_all}:
        return True
    return any(
        path in ((section,), (section, name))
        or (_is_unknown(path) and find_nearest(path[0], _KEYS_OF_NODES) in (None, section))
        for path in lost
    )


def _is_unknown(path: DataPath) -> bool:
    """Return whether a path in a node is an unknown key, such as a misspelt section."""
    return len(path) == 1 and path[0] not in _KEYS_OF_NODES


def _explain_name(
    context: CheckContext, node: NodeSpec, binding: Binding, use: NodeUse
) -> Diagnostic:
    kind = KIND_OF_NOUN[use.kind]
    rule, message = (
        f'unknown-{kind.slug}',
        f"node '{node.name}' declares no {use.kind} '{use.name}'",
    )
    if use.is_optional:
        rule, message = 'missing-parameter', f'{message}, so this is None'
    known, otherwise = getattr(node, kind.section), f"declare it under '{kind.section}:'"
    advice = _advise_method(node, use) or suggest(use.name, known, 'it declares', otherwise)
    related = [bound_at(context, binding)]
    return diagnostic_at(use.place, rule, message, help=advice, related=related)


def _advise_method(node: NodeSpec, use: NodeUse) -> str | None:
    """Return the help for a name of something that another method of the node takes."""
    for noun, kind in KIND_OF_NOUN.items():
        if (
            use.kind != 'parameter'
            and noun != 'parameter'
            and use.name in getattr(node, kind.section)
        ):
            method = next((each for each, of in SENDING_METHODS.items() if of == noun), '')
            a = 'an' if noun[0] in 'aeiou' else 'a'
            return f'it is {a} {noun}{method and ": use node."}{method}'
    return None


def _check_unused(
    context: CheckContext, nodes: list[tuple[NodeSpec, list[Reading]]]
) -> Iterator[Diagnostic]:
    """Warn of what no behaviour uses; an entry that nodes share is used if one node uses it."""
    are_read = any(each.reads_others for _, uses in nodes for each in uses)
    unused: dict[Span, Diagnostic] = {}
    used: set[Span] = set()

    def note(path: DataPath, rule: str, text: str, advice: str, *, is_used: bool) -> None:
        span = context.system.positions.key(path)
        if is_used:
            used.add(span)
        elif span not in unused:
            unused[span] = context.at_key(path, rule, text, help=advice)

    for node, uses in nodes:
        open_kinds = frozenset(kind for each in uses for kind in each.open_kinds)
        # A behaviour may react to changes only, and a node without behaviours has its parameters
        # for others.
        hears = node.before_parameters_set or node.on_parameters or node.after_parameters_set
        open_kinds |= {'parameter'} if are_read or hears or not uses else set()
        names = {(use.kind, use.name) for each in uses for use in each.uses}
        names |= {('publisher', trigger.publish or '') for trigger in node.triggers}
        names |= {('parameter', name) for name in node.followed}
        names |= {('publisher', each.name) for each in node.publishers.values() if each.made_by}
        names |= set(_meant(node, names))
        mentions = context.behaviours.mentions(*uses)
        open_kinds |= mentions.open_kinds
        for kind in USED_KINDS:
            for name, entity in getattr(node, kind.section).items():
                is_used = kind.noun in open_kinds or (kind.noun, name) in names
                is_used = is_used or name in mentions.names or _is_of_ros(kind.noun, name)
                text = f"{kind.noun} '{name}' is declared, and {kind.unused}"
                rule, advice = f'unused-{kind.slug}', 'remove it, or use it in a behaviour'
                note(entity.path, rule, text, advice, is_used=is_used)
        touched = mentions.names.union(*({*each.state_set, *each.state_tested} for each in uses))
        touched |= {use.name for each in uses for use in each.state_read}
        is_open = not uses or any(each.is_state_open for each in uses)
        for name in node.state:
            path = (*node.path, 'state', name)
            text = f"'{name}' is declared in the state, and no behaviour of the node uses it"
            note(path, 'unused-state', text, 'remove it', is_used=is_open or name in touched)
    yield from (finding for span, finding in unused.items() if span not in used)


def _meant(node: NodeSpec, used: set[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield the entities that undeclared names may mean: the nearest one, or all of the kind.

    An undeclared name is one finding; that the entity it means is unused is not another one.
    """
    for kind, name in used:
        declared = getattr(node, KIND_OF_NOUN[kind].section)
        if name and name not in declared and not _is_of_ros(kind, name):
            near = find_nearest(name, declared)
            yield from (
                (each.noun, name) for each in USED_KINDS if 'parameter' not in (kind, each.noun)
            )
            yield from ((kind, each) for each in (declared if near is None else (near,)))


def _is_of_ros(kind: str, name: str) -> bool:
    return kind == 'parameter' and (name in OF_EVERY_NODE or name.startswith(_OF_ROS))
