"""Check expressions over the fields of a message, without the message.

Errors that no message can avoid are reported: bad syntax, unknown names, filters and tests, and
unknown fields. What operators, filters and functions make of values is not looked at.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from jinja2 import TemplateError, nodes

from composer.expressions.sandbox import Sandbox, too_deep
from composer.expressions.templates import describe_syntax
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.message_types import MessageTypes
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.interfaces.catalogue import InterfaceCatalogue

# These accept undefined names.
_FOR_UNDEFINED = ('d', 'default', 'defined', 'undefined')
# These have methods.
_TEXTS = ('string', 'wstring', 'byte')


@record
class ExpressionFinding:
    """One error in an expression, and the part of its text that has it; empty for all of it."""

    rule: str
    message: str
    part: str = ''
    help: str | None = None


@record
class ExpressionValue:
    """The type of the field that an expression is; `None` for a constant."""

    type: FieldType | None
    constant: object = None


def evaluate_over(
    code: str,
    heard: MessageDescription,
    catalogue: InterfaceCatalogue,
    name: str | None = None,
) -> tuple[list[ExpressionFinding], ExpressionValue | None]:
    """Return the errors in an expression, and what is known of its value.

    Args:
        heard: The message.
        catalogue: Describes nested messages; those that it does not know are not checked.
        name: What the message is called. Without it, its fields are in scope as well as `message`.
    """
    sandbox = Sandbox()
    try:
        expression = sandbox.parse_expression(code)
    except TemplateError as error:
        return [ExpressionFinding('bad-expression', describe_syntax(error))], None
    types = {name or 'message': FieldType('message', heard.name)}
    types |= {} if name else {each.name: each.type for each in heard.fields}
    reader = _Reader(sandbox, types, heard, MessageTypes(catalogue))
    try:
        found = reader.type_of(expression)
    except RecursionError:
        return [ExpressionFinding('bad-expression', str(too_deep().message))], None
    if isinstance(expression, nodes.Const):
        return reader.findings, ExpressionValue(None, expression.value)
    return reader.findings, ExpressionValue(found) if found else None


@dataclass(slots=True)
class _Reader:
    """Finds the fields that an expression names, and what is wrong with them."""

    sandbox: Sandbox
    types: Mapping[str, FieldType]
    heard: MessageDescription
    messages: MessageTypes
    findings: list[ExpressionFinding] = field(default_factory=list)
    guarded: set[int] = field(default_factory=set)

    def type_of(self, node: nodes.Node) -> FieldType | None:
        """Return the type of the field that a part is, or `None`; look at all that is in it."""
        if isinstance(node, nodes.Filter | nodes.Test):
            self._check_exists(node)
        inner = [self.type_of(each) for each in node.iter_child_nodes()]
        match node:
            case nodes.Name():
                return self._find_name(node)
            case nodes.Getattr() if inner[0] and not inner[0].array:
                return self._find_field(node, inner[0])
            case nodes.Getitem(arg=nodes.Const(value=int())) if inner[0] and inner[0].array:
                return inner[0].item
        return None

    def _check_exists(self, node: nodes.Filter | nodes.Test) -> None:
        is_filter = isinstance(node, nodes.Filter)
        what = 'filter' if is_filter else 'test'
        known = self.sandbox.filters if is_filter else self.sandbox.tests
        if node.name in _FOR_UNDEFINED:
            self.guarded.add(id(node.node))
        if node.name not in known:
            text = f"there is no {what} '{node.name}'"
            advice = suggest(node.name, known, 'there are')
            self.findings.append(ExpressionFinding('bad-expression', text, node.name, advice))

    def _find_name(self, node: nodes.Name) -> FieldType | None:
        name = node.name
        is_known = name in self.types or name in self.sandbox.globals
        if not is_known and id(node) not in self.guarded:
            text, advice = f"'{name}' is not defined", suggest(name, self.types, 'in scope are')
            self.findings.append(ExpressionFinding('undefined-name', text, name, advice))
        return self.types.get(name)

    def _find_field(self, node: nodes.Getattr, owner: FieldType) -> FieldType | None:
        if owner.nested is None:
            if owner.kind not in _TEXTS and id(node) not in self.guarded:
                text = f"{owner} has no field '{node.attr}'"
                self.findings.append(ExpressionFinding('unknown-field', text, node.attr))
            return None
        of_heard = owner.nested == self.heard.name
        description = self.heard if of_heard else self.messages.describe(owner.nested)
        found = description.field(node.attr) if description else None
        if description is None or found is not None or id(node) in self.guarded:
            return found.type if found else None
        is_constant = node.attr.isupper()
        if is_constant and self.messages.may_have_constant(description.name, node.attr):
            return None
        fields = [each.name for each in description.fields]
        error = unknown_field(description.name, node.attr, fields)
        known = {*fields, *self.messages.constants(description.name)}
        near = find_nearest(node.attr, known) if is_constant else None
        advice = did_you_mean(near, error.help)
        self.findings.append(ExpressionFinding('unknown-field', str(error), node.attr, advice))
        return None
