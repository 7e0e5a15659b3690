"""Check expressions over the fields of a message, without the message.

Errors that no message can avoid are reported: bad syntax, unknown names, filters and tests, and
unknown fields.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jinja2 import TemplateError, nodes

from composer.expressions.sandbox import Sandbox
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.records import record
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.interfaces.catalogue import InterfaceCatalogue

# These accept undefined names.
_FOR_UNDEFINED = ('d', 'default', 'defined', 'undefined')


@record
class ExpressionFinding:
    """One error in an expression.

    Attributes:
        part: The text in it that has the error; empty for all of it.
    """

    rule: str
    message: str
    part: str = ''
    help: str | None = None


@record
class ExpressionValue:
    """What is known of the value of an expression.

    Attributes:
        sample: A value of its type, or the value of a constant; `None` if that is not known.
        noun: The type in words.
        is_constant: Whether the value is always the sample.
        message: The type of the message that it is, if it is one.
    """

    sample: object
    noun: str
    is_constant: bool = False
    message: str | None = None


def value_of_expression(
    code: str, heard: MessageDescription, catalogue: InterfaceCatalogue
) -> ExpressionValue | None:
    """Return what is known of the value of an expression without findings."""
    sandbox = Sandbox()
    walk = _Walk(sandbox, _types_in_scope(heard), catalogue)
    expression = sandbox.parse_expression(code)
    if isinstance(expression, nodes.Const):
        return ExpressionValue(expression.value, repr(expression.value), is_constant=True)
    field_type = walk.type_of(expression)
    if field_type and field_type.nested:
        is_single = field_type.array is None
        return (
            ExpressionValue(None, str(field_type), message=field_type.nested)
            if is_single
            else None
        )
    sample = _Samples(walk).of(expression)
    noun = str(field_type) if field_type else type(sample).__name__
    return None if sample is None else ExpressionValue(sample, noun)


def _types_in_scope(heard: MessageDescription) -> dict[str, FieldType]:
    types = {'message': FieldType('message', heard.name)}
    return types | {field.name: field.type for field in heard.fields}


def check_expression(
    code: str, heard: MessageDescription, catalogue: InterfaceCatalogue
) -> Iterator[ExpressionFinding]:
    """Yield the errors in an expression over the fields of a message.

    Args:
        heard: The message; in scope are its fields, and the message as `message`.
        catalogue: Describes nested messages; those that it does not know are not checked.
    """
    sandbox = Sandbox()
    try:
        expression = sandbox.parse_expression(code)
    except TemplateError as error:
        yield ExpressionFinding('bad-expression', str(error.message))
        return
    walk = _Walk(sandbox, _types_in_scope(heard), catalogue)
    every = [expression, *expression.find_all(nodes.Expr)]
    guarded = {
        id(each.node)
        for each in every
        if isinstance(each, nodes.Filter | nodes.Test) and each.name in _FOR_UNDEFINED
    }
    for node in every:
        if id(node) not in guarded and (finding := walk.check(node)):
            yield finding


@record
class _Walk:
    sandbox: Sandbox
    types: dict[str, FieldType]
    catalogue: InterfaceCatalogue

    def check(self, node: nodes.Expr) -> ExpressionFinding | None:
        match node:
            case nodes.Name():
                return self._check_name(node.name)
            case nodes.Filter() if node.name not in self.sandbox.filters:
                return self._explain_missing('filter', node.name, list(self.sandbox.filters))
            case nodes.Test() if node.name not in self.sandbox.tests:
                return self._explain_missing('test', node.name, list(self.sandbox.tests))
            case nodes.Getattr():
                return self._check_field(node)
        return None

    def _check_name(self, name: str) -> ExpressionFinding | None:
        if name in self.types or name in self.sandbox.globals:
            return None
        help_text = suggest(name, self.types, 'in scope are')
        return ExpressionFinding('undefined-name', f"'{name}' is not defined", name, help_text)

    def _explain_missing(self, what: str, name: str, known: list[str]) -> ExpressionFinding:
        message = f"there is no {what} '{name}'"
        return ExpressionFinding(
            'bad-expression', message, name, suggest(name, known, 'there are')
        )

    def _check_field(self, node: nodes.Getattr) -> ExpressionFinding | None:
        owner = self._describe(self.type_of(node.node))
        # Descriptions of installed packages lack constants, which have names in capitals.
        if owner is None or owner.field(node.attr) or node.attr.isupper():
            return None
        error = unknown_field(owner.name, node.attr, [field.name for field in owner.fields])
        return ExpressionFinding('unknown-field', str(error), node.attr, error.help)

    def type_of(self, node: nodes.Node) -> FieldType | None:
        """Return the type of a field that an expression names, or `None`."""
        match node:
            case nodes.Name():
                return self.types.get(node.name)
            case nodes.Getattr():
                owner = self._describe(self.type_of(node.node))
                field = owner.field(node.attr) if owner else None
                return field.type if field else None
            case nodes.Getitem(arg=nodes.Const()):
                array = self.type_of(node.node)
                return array.item if array and array.array else None
        return None

    def _describe(self, field_type: FieldType | None) -> MessageDescription | None:
        if field_type is None or field_type.array or field_type.nested is None:
            return None
        description = self.catalogue.describe(field_type.nested)
        return description if isinstance(description, MessageDescription) else None


# A value of each kind of field; of the other kinds, integers.
_SAMPLES: dict[str, object] = {
    'bool': True,
    'byte': b'a',
    'float32': 0.5,
    'float64': 0.5,
    'string': 'a',
    'wstring': 'a',
}
_OF_NODES: dict[type, object] = {
    nodes.Compare: True,
    nodes.Concat: 'a',
    nodes.Not: True,
    nodes.Test: True,
}
_OF_FILTERS: dict[str, object] = {
    **dict.fromkeys(('count', 'int', 'length'), 1),
    **dict.fromkeys(('capitalize', 'join', 'lower', 'string', 'title', 'trim', 'upper'), 'a'),
    'float': 0.5,
}


@record
class _Samples:
    """Values of the types that expressions have; `None` where nobody knows."""

    walk: _Walk

    def of(self, node: nodes.Node) -> object | None:
        if isinstance(node, nodes.Const):
            return node.value  # type: ignore[no-any-return]
        if isinstance(node, nodes.Name | nodes.Getattr | nodes.Getitem):
            return self._of_field(self.walk.type_of(node))
        if isinstance(node, nodes.Filter):
            return _OF_FILTERS.get(node.name)
        if isinstance(node, nodes.Add | nodes.Sub | nodes.Mul | nodes.Div):
            return self._of_numbers(node.left, node.right, is_float=isinstance(node, nodes.Div))
        if isinstance(node, nodes.Neg | nodes.Pos):
            return self._of_numbers(node.node)
        return _OF_NODES.get(type(node))

    def _of_numbers(self, *operands: nodes.Node, is_float: bool = False) -> float | None:
        kinds = {type(self.of(each)) for each in operands}
        if not kinds <= {int, float}:
            return None
        return 0.5 if is_float or float in kinds else 1

    def _of_field(self, field_type: FieldType | None) -> object | None:
        if field_type is None or field_type.nested is not None:
            return None
        sample = _SAMPLES.get(field_type.kind, 1)
        return sample if field_type.array is None else [sample]
