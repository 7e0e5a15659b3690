"""A plan as text: a line for each operation, and their count."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from composer.confidential import conceal
from composer.planning.plan import Action
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.planning.plan import Change, Operation, Plan

_COLOURS = {
    Action.ADD: 'green',
    Action.CHANGE: 'yellow',
    Action.RECREATE: 'magenta',
    Action.REMOVE: 'red',
}
_VERBS = {
    Action.ADD: 'to add',
    Action.CHANGE: 'to change',
    Action.RECREATE: 'to recreate',
    Action.REMOVE: 'to remove',
}
_LONGEST_VALUE = 60
# Of an edit that no system can take while it runs.
NEEDS_RESTART = 'this needs a restart: composer down, then composer up'


def render_plan(plan: Plan, *, colour: bool = False) -> str:
    """Return a plan as text, with a newline at its end."""
    lines = [_render_operation(each, colour=colour) for each in plan.operations]
    counts = [f'{count} {_VERBS[action]}' for action, count in plan.counts().items() if count]
    lines.append(f'{escape(plan.name)}: {", ".join(counts) or "no difference"}')
    return '\n'.join(lines) + '\n'


def describe_change(change: Change) -> str:
    """Return `period 0.5 → 1.0 (arm.yaml:12 → new.yaml:12)`."""
    places = _describe_places(change)
    if change.is_code:
        what = 'other definitions' if change.top_key == 'interfaces' else 'new code'
        return f'{change.key} has {what}{places}'
    values = _show_both(change.old, change.new)
    if change.old is None:
        return f'{change.key} = {values[1]}{places}'
    if change.new is None:
        return f'{change.key} = {values[0]} goes{places}'
    return f'{change.key} {values[0]} → {values[1]}{places}'


def _render_operation(operation: Operation, *, colour: bool) -> str:
    sign = operation.action.value
    if colour:
        sign = click.style(sign, fg=_COLOURS[operation.action])
    return f'{sign} {escape("; ".join(_describe(operation)))}'


def _describe(operation: Operation) -> Iterator[str]:
    full_name, section, _ = operation.target
    # Several nodes in different namespaces may have one name.
    node = full_name if full_name.count('/') > 1 else full_name.removeprefix('/')
    subject = f"{operation.noun} '{node if section == 'nodes' else operation.name}'"
    if node and section != 'nodes':
        subject += f" of '{node}'"
    changes = ', '.join(map(describe_change, operation.changes))
    yield f'{subject}: {changes}' if changes else f'{subject} ({operation.span.place})'
    if operation.reason:
        yield operation.reason
    if operation.lost:
        yield f'lost: {", ".join(operation.lost)}'
    if operation.noun == 'system' and operation.action is Action.RECREATE:
        yield NEEDS_RESTART
    yield from operation.notes


def _describe_places(change: Change) -> str:
    """Return where the values stand: both, if there are two."""
    old, new = (each and each.place for each in (change.old_span, change.new_span))
    if not change.is_code and change.new is None:
        new = None
    elif change.is_code or change.old is None or old == new:
        old = None
    places = ' → '.join(each for each in (old, new) if each)
    return f' ({places})' if places else ''


def _show_both(old: Any, new: Any) -> list[str]:
    """Return two values as text, long ones cut around where they differ."""
    texts = [_write(each) for each in (old, new)]
    start = 0
    if None not in (old, new):
        pairs = zip(*texts, strict=False)
        same = next((i for i, (a, b) in enumerate(pairs) if a != b), min(map(len, texts)))
        start = max(0, same - _LONGEST_VALUE // 3) if same > _LONGEST_VALUE // 2 else 0
    return [_cut(text, start) for text in texts]


def _cut(text: str, start: int) -> str:
    if len(text) <= _LONGEST_VALUE:
        return text
    shown = text[start : start + _LONGEST_VALUE]
    return f'{"…" * (start > 0)}{shown}{"…" * (start + _LONGEST_VALUE < len(text))}'


def _write(value: Any) -> str:
    """Return a value as text; what is hidden is so before a part of it is cut away."""
    text = json.dumps(value, ensure_ascii=False, default=str)
    return conceal(value if isinstance(value, str) and _is_plain(value) else text)


def _is_plain(text: str) -> bool:
    """Tell whether text needs no quotes: it is a word that is no number, and no other value."""
    if not text or any(map(str.isspace, text)):
        return False
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return True
    return False
