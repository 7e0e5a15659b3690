"""Check expressions over the fields of a message, without the message.

Errors that no message can avoid are reported: bad syntax, unknown names, filters and tests,
unknown fields, and operands of the wrong type.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jinja2 import TemplateError, nodes

from composer.checks.behaviours.sample_values import (
    ExpressionFinding,
    SampleEvaluator,
    SampleMessage,
)
from composer.expressions.sandbox import Sandbox, too_deep
from composer.expressions.templates import describe_syntax
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.records import record

if TYPE_CHECKING:
    from composer.interfaces.catalogue import InterfaceCatalogue


@record
class ExpressionValue:
    """What is known of the value of an expression.

    Attributes:
        sample: A value of its type, or the value of a constant.
        noun: The type in words.
        is_constant: Whether the value is always the sample.
        message: The type of the message that it is, if it is one.
    """

    sample: object
    noun: str
    is_constant: bool = False
    message: str | None = None


def evaluate_over(
    code: str, heard: MessageDescription, catalogue: InterfaceCatalogue
) -> tuple[list[ExpressionFinding], ExpressionValue | None]:
    """Return the errors in an expression, and what is known of its value.

    Args:
        heard: The message; in scope are its fields, and the message as `message`.
        catalogue: Describes nested messages; those that it does not know are not checked.
    """
    sandbox = Sandbox()
    try:
        expression = sandbox.parse_expression(code)
    except TemplateError as error:
        return [ExpressionFinding('bad-expression', describe_syntax(error))], None
    types = {'message': FieldType('message', heard.name)}
    types |= {field.name: field.type for field in heard.fields}
    evaluator = SampleEvaluator(sandbox, types, catalogue)
    try:
        value = evaluator.value(expression)
    except RecursionError:
        return [ExpressionFinding('bad-expression', str(too_deep().message))], None
    if isinstance(expression, nodes.Const):
        known = ExpressionValue(value, repr(value), is_constant=True)
    elif isinstance(value, SampleMessage):
        name = evaluator.noun_of(expression)
        known = ExpressionValue(None, name, message=name)
    else:
        # A whole number would fit an integer.
        sample = 0.5 if isinstance(value, float) else value
        known = ExpressionValue(sample, evaluator.noun_of(expression))
    return evaluator.findings, None if _has_gaps(value) else known


def _has_gaps(value: Any) -> bool:
    """Return whether a value cannot be compared with the type of a field."""
    if isinstance(value, list | tuple | dict):
        items = value.values() if isinstance(value, dict) else value
        return any(isinstance(each, SampleMessage) or _has_gaps(each) for each in items)
    return not isinstance(value, str | int | float | bytes | SampleMessage | None)
