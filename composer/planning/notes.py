"""What else to know of an operation: what becomes of goals, generators and values set live."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from composer.planning.plan import Action

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.language.specs import NodeSpec
    from composer.planning.plan import Operation
    from composer.planning.snapshot import Snapshot

_GOING = (Action.RECREATE, Action.REMOVE)


def with_notes(operation: Operation, node: NodeSpec, old: Snapshot) -> Operation:
    """Return an operation on a node of the old system, or a part of it, with all its notes."""
    notes = (*operation.notes, *_notes(operation, node, old))
    return replace(operation, notes=notes, lost=_lost(operation, old))


def _notes(operation: Operation, node: NodeSpec, old: Snapshot) -> Iterator[str]:
    _, section, name = operation.target
    is_going = operation.action in _GOING
    keys = {each.top_key for each in operation.changes}
    has_new_behaviour = operation.action is Action.CHANGE and bool(keys & {'behaviour', 'with'})
    if is_going and (section == 'actions' or (section == 'nodes' and node.actions)):
        yield 'goals in flight end first'
    elif section == 'actions' and has_new_behaviour:
        yield 'goals in flight end as they began'
    elif section == 'timers' and has_new_behaviour:
        behaviour = node.timers[name].behaviour
        if behaviour is not None and behaviour.name in old.generators:
            yield 'its generator begins anew, unless it has ended'
    elif not is_going and keys & {'default', 'value'} and _is_set(operation, old):
        yield 'the value that was set while it ran stays'


def _lost(operation: Operation, old: Snapshot) -> tuple[str, ...]:
    """Return what goes with it; nothing with a parameter that nobody has set."""
    is_known = operation.target[1] == 'parameters' and old.set_live is not None
    return () if is_known and not _is_set(operation, old) else operation.lost


def _is_set(operation: Operation, old: Snapshot) -> bool:
    full_name, section, name = operation.target
    return section == 'parameters' and name in (old.set_live or {}).get(full_name, ())
