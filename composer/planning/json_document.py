"""A plan as one JSON document, as `schemas/plan.schema.json` describes it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.confidential import conceal_data

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.planning.plan import Change, Operation, Plan


def render_plan(plan: Plan) -> str:
    """Return a plan as JSON, with a newline at its end."""
    document = {
        'version': 1,
        'name': plan.name,
        'counts': {action.name.lower(): count for action, count in plan.counts().items()},
        'operations': [_describe_operation(each) for each in plan.operations],
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + '\n'


def _describe_operation(operation: Operation) -> dict[str, Any]:
    full_name, section, _ = operation.target
    return {
        'action': operation.action.name.lower(),
        'kind': operation.noun,
        'name': operation.name,
        'node': full_name
        if section not in ('components', 'processes', 'system', 'workers')
        else None,
        'place': _describe_span(operation.span),
        'changes': [_describe_change(each) for each in operation.changes],
        'reason': operation.reason or None,
        'lost': list(operation.lost),
        'notes': list(operation.notes),
    }


def _describe_change(change: Change) -> dict[str, Any]:
    return {
        'key': change.key,
        'is_code': change.is_code,
        'old': _as_json(change.old),
        'new': _as_json(change.new),
        'old_place': _describe_span(change.old_span),
        'new_place': _describe_span(change.new_span),
    }


def _describe_span(span: Span | None) -> dict[str, Any] | None:
    if span is None:
        return None
    return {'file': span.source.name, 'line': span.line, 'column': span.column}


def _as_json(value: Any) -> Any:
    """Return a value as JSON has it: it knows no infinity."""
    return json.loads(json.dumps(conceal_data(value), default=str), parse_constant=str)
