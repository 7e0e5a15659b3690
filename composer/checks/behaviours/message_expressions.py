"""Expressions over the fields of a message, before there is one.

What is wrong with them whatever the message holds: what cannot be read, names and filters that do
not exist, and fields that a message has not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from jinja2 import TemplateError, nodes

from composer.expressions.sandbox import Sandbox
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.interfaces.catalogue import InterfaceCatalogue

# With these a name may be anything.
_FOR_UNDEFINED = ('d', 'default', 'defined', 'undefined')


@dataclass(frozen=True, slots=True)
class ExpressionFault:
    """One thing that is wrong with an expression.

    Attributes:
        part: The text in it that is meant; empty for all of it.
    """

    rule: str
    message: str
    part: str = ''
    help: str | None = None


def find_expression_faults(
    code: str, heard: MessageDescription, catalogue: InterfaceCatalogue
) -> Iterator[ExpressionFault]:
    """Yield what is wrong with an expression over the fields of a message.

    Args:
        heard: The message; its fields are in scope, and it itself as `message`.
        catalogue: Describes nested messages; what it does not know is taken as right.
    """
    sandbox = Sandbox()
    try:
        expression = sandbox.parse_expression(code)
    except TemplateError as error:
        yield ExpressionFault('bad-expression', str(error.message))
        return
    types = {'message': FieldType('message', heard.name)}
    types |= {field.name: field.type for field in heard.fields}
    walk = _Walk(sandbox, types, catalogue)
    every = [expression, *expression.find_all(nodes.Expr)]
    guarded = {
        id(each.node)
        for each in every
        if isinstance(each, nodes.Filter | nodes.Test) and each.name in _FOR_UNDEFINED
    }
    for node in every:
        if id(node) not in guarded and (fault := walk.find_fault(node)):
            yield fault


@dataclass(frozen=True, slots=True)
class _Walk:
    sandbox: Sandbox
    types: dict[str, FieldType]
    catalogue: InterfaceCatalogue

    def find_fault(self, node: nodes.Expr) -> ExpressionFault | None:
        match node:
            case nodes.Name():
                return self._find_name_fault(node.name)
            case nodes.Filter() if node.name not in self.sandbox.filters:
                return self._explain_missing('filter', node.name, list(self.sandbox.filters))
            case nodes.Test() if node.name not in self.sandbox.tests:
                return self._explain_missing('test', node.name, list(self.sandbox.tests))
            case nodes.Getattr():
                return self._find_field_fault(node)
        return None

    def _find_name_fault(self, name: str) -> ExpressionFault | None:
        if name in self.types or name in self.sandbox.globals:
            return None
        help_text = suggest(name, self.types, 'in scope are')
        return ExpressionFault('undefined-name', f"'{name}' is not defined", name, help_text)

    def _explain_missing(self, what: str, name: str, known: list[str]) -> ExpressionFault:
        message = f"there is no {what} '{name}'"
        return ExpressionFault('bad-expression', message, name, suggest(name, known, 'there are'))

    def _find_field_fault(self, node: nodes.Getattr) -> ExpressionFault | None:
        owner = self._describe(self._type_of(node.node))
        # Descriptions of installed packages are without constants, whose names are such.
        if owner is None or owner.field(node.attr) or node.attr.isupper():
            return None
        error = unknown_field(owner.name, node.attr, [field.name for field in owner.fields])
        return ExpressionFault('unknown-field', str(error), node.attr, error.help)

    def _type_of(self, node: nodes.Node) -> FieldType | None:
        """Return the type of what an expression gives, if it is a field and its place is plain."""
        match node:
            case nodes.Name():
                return self.types.get(node.name)
            case nodes.Getattr():
                owner = self._describe(self._type_of(node.node))
                field = owner.field(node.attr) if owner else None
                return field.type if field else None
            case nodes.Getitem(arg=nodes.Const()):
                array = self._type_of(node.node)
                return array.item if array and array.array else None
        return None

    def _describe(self, field_type: FieldType | None) -> MessageDescription | None:
        if field_type is None or field_type.array or field_type.nested is None:
            return None
        description = self.catalogue.describe(field_type.nested)
        return description if isinstance(description, MessageDescription) else None
