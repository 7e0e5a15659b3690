"""Checks of messages in a scenario file against the fields of their type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from composer.expressions.templates import describe_syntax
from composer.interfaces.descriptions import (
    ActionDescription,
    MessageDescription,
    ServiceDescription,
)
from composer.interfaces.payload_checks import check_payload
from composer.scenarios.checks.time_checks import value_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.yaml_text.positions import DataPath

_OPEN = '{{'
_PARTS: dict[str, type] = {
    'request': ServiceDescription,
    'response': ServiceDescription,
    'goal': ActionDescription,
    'feedback': ActionDescription,
    'result': ActionDescription,
}


def part_of(
    context: ScenarioContext, kind: ChannelKind, name: str, part: str, type_name: str | None
) -> MessageDescription | None:
    """Describe a part of what a topic, service or action has; `None` if it is not known.

    Args:
        part: `message`, `request`, `response`, `goal`, `feedback` or `result`.
        type_name: The type that the scenario gives; `None` for that of the system.
    """
    description = context.describe(context.type_of(kind, name) or type_name)
    if isinstance(description, MessageDescription):
        return description if part == 'message' else None
    owner = _PARTS.get(part)
    is_right = owner is not None and isinstance(description, owner)
    return cast('MessageDescription', getattr(description, part)) if is_right else None


def check_message(
    context: ScenarioContext, description: MessageDescription | None, path: DataPath
) -> Iterator[Diagnostic]:
    """Check the data at a path against a message; fields may be left out."""
    data = value_at(context, path)
    if description is None or data is None:
        return
    for finding in check_payload(description, data, context.catalogue):
        is_key = finding.rule == 'unknown-field'
        at = context.at_key if is_key else context.at_value
        yield at((*path, *finding.path), finding.rule, finding.message, help=finding.help)


def check_computed_message(
    context: ScenarioContext,
    description: MessageDescription | None,
    path: DataPath,
    scope: tuple[str, MessageDescription | None],
) -> Iterator[Diagnostic]:
    """Check data that may hold expressions over one message.

    Args:
        scope: The name of the message in expressions, and what it has.
    """
    data = value_at(context, path)
    for finding in check_message(context, description, path):
        is_computed = finding.span is not None and _OPEN in finding.span.text
        if finding.rule == 'unknown-field' or not is_computed:
            yield finding
    if scope[1] is not None:
        yield from _check_expressions(context, data, path, scope[0], scope[1])


def _check_expressions(
    context: ScenarioContext, data: Any, path: DataPath, name: str, heard: MessageDescription
) -> Iterator[Diagnostic]:
    if isinstance(data, dict | list):
        items = data.items() if isinstance(data, dict) else enumerate(data)
        for key, value in items:
            yield from _check_expressions(context, value, (*path, key), name, heard)
    elif isinstance(data, str) and _OPEN in data:
        yield from _check_text(context, data, path, name, heard)


def _check_text(
    context: ScenarioContext, text: str, path: DataPath, name: str, heard: MessageDescription
) -> Iterator[Diagnostic]:
    # The import of jinja2 takes a tenth of the time of a check.
    from jinja2 import TemplateError

    from composer.checks.behaviours.message_expressions import evaluate_over
    from composer.expressions.sandbox import Sandbox
    from composer.expressions.scanner import code_of, find_expressions

    try:
        for expression in find_expressions(text, Sandbox()):
            code = code_of(text, expression)
            for each in evaluate_over(code, heard, context.catalogue, name)[0]:
                yield context.at_value(
                    path, each.rule, each.message, part=each.part, help=each.help
                )
    except TemplateError as error:
        yield context.at_value(path, 'bad-expression', describe_syntax(error))


def check_condition(
    context: ScenarioContext, description: MessageDescription | None, path: DataPath
) -> Iterator[Diagnostic]:
    """Check an expression over the fields of a message."""
    code = value_at(context, path)
    if not isinstance(code, str):
        return
    if _OPEN in code:
        help_text = 'the whole text is the expression'
        yield context.at_value(path, 'bad-expression', 'write it without braces', help=help_text)
        return
    # The import of jinja2 takes a tenth of the time of a check.
    from composer.checks.behaviours.message_expressions import evaluate_over

    # Of a message that is not known, the form of the expression can still be wrong.
    heard = description or MessageDescription('unknown', ())
    findings, value = evaluate_over(code, heard, context.catalogue)
    if value is not None and value.type is None:
        message = 'this is the same for every message'
        yield context.at_value(path, 'nothing-expected', message, help='name a field')
    for each in findings:
        if description is not None or each.rule == 'bad-expression':
            yield context.at_value(path, each.rule, each.message, part=each.part, help=each.help)
