"""Payloads of stand-ins: data in which `{{ … }}` are expressions over a request or a goal."""

from __future__ import annotations

from typing import Any

from jinja2 import StrictUndefined

from composer.errors import ComposerError
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.sandbox import Sandbox
from composer.expressions.scanner import OPEN, code_of, find_expressions
from composer.scenarios.fields import explain_error, view_fields, without_views
from composer.yaml_text.scalars import format_scalar


class PayloadError(ComposerError):
    """An expression of a stand-in cannot be evaluated."""


def compute_payload(data: Any, name: str, message: Any) -> Any:
    """Return data with the values of all expressions in place.

    A text that is one whole expression becomes its value, of any type.

    Args:
        name: What the message is called in expressions: `request` or `goal`.

    Raises:
        PayloadError: An expression cannot be evaluated.
    """
    if isinstance(data, dict):
        return {key: compute_payload(value, name, message) for key, value in data.items()}
    if isinstance(data, list):
        return [compute_payload(item, name, message) for item in data]
    if not isinstance(data, str) or OPEN not in data:
        return data
    return _compute_text(data, {name: view_fields(message)})


def _value_of(sandbox: Sandbox, code: str, scope: dict[str, Any]) -> Any:
    value = evaluate_expression(sandbox, code, scope)
    if isinstance(value, StrictUndefined):
        str(value)  # raises what is undefined
    return without_views(value)


def _compute_text(text: str, scope: dict[str, Any]) -> Any:
    sandbox = Sandbox()
    try:
        expressions = list(find_expressions(text, sandbox))
        values = [_value_of(sandbox, code_of(text, each), scope) for each in expressions]
    except Exception as error:
        message = f'{text!r}: {explain_error(error)}'
        raise PayloadError(message) from error
    first = expressions[0]
    if len(expressions) == 1 and not (text[: first.start] + text[first.stop :]).strip():
        return values[0]
    parts, start = [], 0
    for expression, value in zip(expressions, values, strict=True):
        parts += [text[start : expression.start], format_scalar(value)]
        start = expression.stop
    return ''.join([*parts, text[start:]])
