"""Behaviours do not wait for what only others of their own callback group can bring about."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.checks.behaviours.behaviour_bodies import bound_at, readings_of
from composer.checks.connections.deadlocks import group_in
from composer.diagnostics import Related, diagnostic_at
from composer.node_uses.waiting import FILLING, QUEUES

if TYPE_CHECKING:
    from collections.abc import Iterator
    from collections.abc import Set as AbstractSet

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.node_uses.reading import Awaited, Block, Reading

# What brings about what is waited for, by the kind of that.
_VERBS = {
    'threading.Condition': 'notifies',
    **dict.fromkeys(QUEUES, 'fills'),
}
_INSTEAD = 'let a timer do the rest, or a generator, which a timer resumes'
_Read: TypeAlias = 'tuple[NodeSpec, Binding, Reading]'


def check_blocked_groups(context: CheckContext) -> Iterator[Diagnostic]:
    """Check what behaviours wait for in their threads; each place once."""
    every = [
        (node, binding, reading)
        for node in context.spec.nodes.values()
        for binding, reading in readings_of(context, node)
    ]
    found: dict[Span, Diagnostic] = {}
    for waiter in every:
        for block in waiter[2].blocks:
            fillers = _find_fillers(context, waiter, block.what, every)
            if fillers and all(_is_blocked(waiter, each) for each in fillers):
                found.setdefault(block.place, _explain(context, waiter, block, fillers[0]))
        for seconds, place in waiter[2].sleeps:
            if _is_long(waiter, seconds, every):
                owner = waiter[1].owner
                text = f'{owner} does nothing for {seconds:g} s here, and nothing else of its '
                text += 'callback group runs meanwhile'
                related = [bound_at(context, waiter[1])]
                late = diagnostic_at(place, 'long-sleep', text, help=_INSTEAD, related=related)
                found.setdefault(place, late)
    yield from found.values()


def _is_long(waiter: _Read, seconds: float, every: list[_Read]) -> bool:
    """Return whether a behaviour keeps others of its group, or its own timer, from running."""
    node, binding, _ = waiter
    group, entity = group_in(node, binding), binding.entity
    limit = getattr(entity, 'warn_after_sec', None)
    has_group = group is not None and getattr(binding.kind, 'has_group', False)
    if not has_group or limit is None or seconds < limit:
        return False
    others = (group_in(other, each) == group for other, each, _ in every if each is not binding)
    return any(others) or seconds > getattr(entity, 'period_sec', seconds)


def _find_fillers(
    context: CheckContext, waiter: _Read, what: Awaited, every: list[_Read]
) -> list[_Read]:
    """Return the behaviours that bring about what one waits for; none if others may."""
    node, _, waiting = waiter
    several = every
    if what.owner == 'state':
        # Each node has its own.
        several = [each for each in every if each[0] is node]
        if any(reading.is_state_open for _, _, reading in several):
            return []
    if waiting.reaches_ros or what in waiting.asked or what in waiting.fills:
        return []
    fillers = [each for each in several if each is not waiter and _may_fill(each[2], what)]
    is_beside = any(False in reading.fills.get(what, ()) for _, _, reading in fillers)
    names: AbstractSet[str] = FILLING.get(what.kind) or {what.name}
    for _, _, reading in several:
        if names & context.behaviours.mentions(reading).names:
            return []
    return [] if is_beside or not any(what in each[2].fills for each in fillers) else fillers


def _may_fill(reading: Reading, what: Awaited) -> bool:
    """Return whether a behaviour brings something about, or changes it in another way."""
    if what in reading.fills:
        return True
    is_of_state = what.owner == 'state'
    return is_of_state and any(use.name == what.name for use in reading.state_read)


def _is_blocked(waiter: _Read, filler: _Read) -> bool:
    """Return whether a behaviour cannot run while another one waits."""
    (node, binding, _), (other, filling, _) = waiter, filler
    if binding.owner == 'on_start':
        if filling.kind is None:
            return False
        # What serves may do so from the start of its node on.
        return other is node or (not node.starts_late and filling.kind.channel in (None, 'topic'))
    group = group_in(node, binding)
    return group is not None and group == group_in(other, filling)


def _explain(context: CheckContext, waiter: _Read, block: Block, filler: _Read) -> Diagnostic:
    (_, binding, _), (_, filling, _), what = waiter, filler, block.what
    verb, shown = _VERBS.get(what.kind, 'sets'), f"'{what.name}'"
    if what.made_at is not None or what.owner == 'state':
        shown = what.name if what.made_at is not None else f"'node.state.{what.name}'"
    reason = f'which only {filling.owner} of the same callback group {verb}: neither can continue'
    advice = f'give {filling.owner} a group of its own, or do the rest there'
    if binding.owner == 'on_start':
        reason = f'which only {filling.owner} {verb}, and that runs after it'
        advice = 'do the rest in the behaviour that it comes to'
    places = (('it is called here', block.called_at), ('it is made here', what.made_at))
    here = (block.place.source, block.place.line)
    related = [
        *(Related(text, at) for text, at in places if at and (at.source, at.line) != here),
        *(bound_at(context, each) for each in (binding, filling)),
    ]
    message = f'{binding.owner} waits for {shown}, {reason}'
    return diagnostic_at(block.place, 'blocked-group', message, help=advice, related=related)
