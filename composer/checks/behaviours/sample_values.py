"""Evaluates expressions over a message that has a type, and no values yet.

Each field has a sample: some value of its type. What raises a `TypeError` with samples raises it
with every message; of what else depends on values, nothing is said.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from jinja2 import Undefined, nodes
from jinja2.exceptions import SecurityError

from composer.expressions.evaluation import Evaluator
from composer.expressions.sandbox import Method
from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.message_types import MessageTypes
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.expressions.sandbox import Sandbox
    from composer.interfaces.catalogue import InterfaceCatalogue

UNKNOWN: Final[Any] = type('Unknown', (), {})()

# These accept undefined names.
_FOR_UNDEFINED = ('d', 'default', 'defined', 'undefined')
# A value of each kind of field; of the other kinds, integers.
_OF_FIELDS: dict[str, object] = {
    'bool': True,
    'byte': b'a',
    'float32': 0.5,
    'float64': 0.5,
    'string': 'a',
    'wstring': 'a',
}
# What these return whatever they are given.
_OF_NODES: dict[type, object] = {
    nodes.Compare: True,
    nodes.Concat: 'a',
    nodes.Not: True,
    nodes.Test: True,
}
_OF_FILTERS: dict[str, object] = {
    **dict.fromkeys(('count', 'int', 'length', 'wordcount'), 1),
    **dict.fromkeys(('capitalize', 'join', 'lower', 'string', 'title', 'trim', 'upper'), 'a'),
    'float': 0.5,
}


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


class SampleMessage:
    """A message whose fields are samples."""

    def __init__(self, description: MessageDescription, catalogue: InterfaceCatalogue) -> None:
        # Names that begin with an underscore are no fields.
        self._description = description
        self._catalogue = catalogue

    def __getattr__(self, name: str) -> object:
        field = self._description.field(name)
        if field is None:
            raise AttributeError(name)
        return sample_of(field.type, self._catalogue)


def describe_sample(message: SampleMessage) -> MessageDescription:
    """Return what a message has; a method of it would look like a field."""
    return message._description  # noqa: SLF001


class _Numbers(list[object]):
    """An array of a fixed length, which numpy holds: it takes more operators than a list."""


def sample_of(field_type: FieldType, catalogue: InterfaceCatalogue) -> Any:
    """Return a value of a type, or `UNKNOWN`."""
    if field_type.nested is None:
        item = _OF_FIELDS.get(field_type.kind, 1)
    else:
        description = catalogue.describe(field_type.nested)
        if not isinstance(description, MessageDescription):
            return UNKNOWN
        item = SampleMessage(description, catalogue)
    if field_type.array is None:
        return item
    is_numpy = field_type.array == 'fixed' and isinstance(item, int | float)
    return _Numbers([item]) if is_numpy else [item]


class SampleEvaluator(Evaluator):
    """Evaluates the parts of one expression, and finds those that no message allows.

    Attributes:
        findings: What was found so far.
    """

    def __init__(
        self, sandbox: Sandbox, types: Mapping[str, FieldType], catalogue: InterfaceCatalogue
    ) -> None:
        super().__init__(sandbox, {})
        sandbox.budget.begin()
        self.findings: list[ExpressionFinding] = []
        self._types = types
        self._catalogue = catalogue
        self._messages = MessageTypes(catalogue)
        self._known: dict[int, Any] = {}
        self._guarded: set[int] = set()

    def value(self, node: nodes.Node | None) -> Any:
        """Return a value of the type of a part, or `UNKNOWN`."""
        if id(node) not in self._known:
            if isinstance(node, nodes.Filter | nodes.Test) and node.name in _FOR_UNDEFINED:
                self._guarded.add(id(node.node))
            found = self._find(node) if node else None
            self._known[id(node)] = UNKNOWN if isinstance(found, Undefined) else found
        return self._known[id(node)]

    def noun_of(self, node: nodes.Node) -> str:
        """Return the type of the value of a part in words."""
        field_type = self.type_of(node)
        return str(field_type) if field_type else _noun(self.value(node))

    def type_of(self, node: nodes.Node) -> FieldType | None:
        """Return the type of a field that an expression names, or `None`."""
        match node:
            case nodes.Name():
                return self._types.get(node.name)
            case nodes.Getattr():
                owner = self.value(node.node)
                is_message = isinstance(owner, SampleMessage)
                field = describe_sample(owner).field(node.attr) if is_message else None
                return field.type if field else None
            case nodes.Getitem(arg=nodes.Const()):
                array = self.type_of(node.node)
                return array.item if array and array.array else None
        return None

    def _find(self, node: nodes.Node) -> Any:
        operands = [self.value(each) for each in _operands(node)]
        match node:
            case nodes.Name():
                return self._find_name(node)
            case nodes.Getattr():
                return self._find_attribute(node, *operands)
            case nodes.Getitem():
                return self._find_item(node, *operands)
            case nodes.CondExpr() | nodes.And() | nodes.Or():
                return _either(*operands[-2:])
            case nodes.Filter() | nodes.Test() if not self._exists(node):
                return UNKNOWN
        is_known = all(each is not UNKNOWN for each in operands)
        if is_known and not isinstance(node, nodes.Test) and not _formats(node, operands):
            return self._apply(node, operands)
        if isinstance(node, nodes.Filter):
            return _OF_FILTERS.get(node.name, UNKNOWN)
        return _OF_NODES.get(type(node), UNKNOWN)

    def _exists(self, node: nodes.Filter | nodes.Test) -> bool:
        is_filter = isinstance(node, nodes.Filter)
        known = self.sandbox.filters if is_filter else self.sandbox.tests
        if node.name not in known:
            what = 'filter' if is_filter else 'test'
            help_text = suggest(node.name, known, 'there are')
            self._report(f"there is no {what} '{node.name}'", node.name, help_text=help_text)
        return node.name in known

    def _apply(self, node: nodes.Node, operands: list[Any]) -> Any:
        try:
            return super().value(node)
        except TypeError:
            if not any(isinstance(each, _Numbers) for each in operands):
                self._report(self._explain(node))
        except SecurityError:
            self._report(f'{_noun(operands[0])} cannot be called')
        except ZeroDivisionError:
            if isinstance(node, nodes.BinExpr) and isinstance(node.right, nodes.Const):
                self._report('division by zero')
        except Exception:  # noqa: BLE001 - with other values it may not be raised
            return UNKNOWN
        return UNKNOWN

    def _explain(self, node: nodes.Node) -> str:
        match node:
            case nodes.Call(node=nodes.Getattr() as method):
                return f"'{method.attr}' does not take these arguments"
            case nodes.Filter() if node.node is not None:
                return f"the filter '{node.name}' does not take {self.noun_of(node.node)}"
            case nodes.Compare():
                other = self.noun_of(node.ops[0].expr)
                return f'cannot compare {self.noun_of(node.expr)} with {other}'
            case nodes.BinExpr():
                both = f'{self.noun_of(node.left)} and {self.noun_of(node.right)}'
                return f"'{node.operator}' does not take {both}"
            case nodes.UnaryExpr():
                return f"'{node.operator}' does not take {self.noun_of(node.node)}"
        return 'these values do not fit together'

    def _find_name(self, node: nodes.Name) -> Any:
        if node.name in self._types:
            return sample_of(self._types[node.name], self._catalogue)
        if node.name not in self.sandbox.globals and id(node) not in self._guarded:
            self._report(
                f"'{node.name}' is not defined",
                node.name,
                rule='undefined-name',
                help_text=suggest(node.name, self._types, 'in scope are'),
            )
        return UNKNOWN

    def _find_attribute(self, node: nodes.Getattr, owner: Any) -> Any:
        is_open = owner is UNKNOWN or isinstance(owner, _Numbers | Method)
        found = UNKNOWN if is_open else self.sandbox.attribute(owner, node.attr)
        if not isinstance(found, Undefined) or id(node) in self._guarded:
            return found
        if isinstance(owner, SampleMessage):
            description = describe_sample(owner)
            is_constant = node.attr.isupper()
            if is_constant and self._messages.may_have_constant(description.name, node.attr):
                return UNKNOWN
            fields = [field.name for field in description.fields]
            error = unknown_field(description.name, node.attr, fields)
            known = {*fields, *self._messages.constants(description.name)}
            near = find_nearest(node.attr, known) if is_constant else None
            help_text = did_you_mean(near, error.help)
            self._report(str(error), node.attr, rule='unknown-field', help_text=help_text)
        else:
            message = f"{self.noun_of(node.node)} has no field '{node.attr}'"
            self._report(message, node.attr, rule='unknown-field')
        return UNKNOWN

    def _find_item(self, node: nodes.Getitem, owner: Any, index: Any = UNKNOWN) -> Any:
        if owner is UNKNOWN:
            return UNKNOWN
        if isinstance(index, int) and isinstance(owner, list | str):
            # How many there are, nobody knows.
            return owner[0] if owner else UNKNOWN
        if isinstance(index, slice) and isinstance(owner, list | str):
            return owner
        is_field = isinstance(index, str) and isinstance(owner, SampleMessage)
        if is_field or isinstance(owner, dict | bytes) or index is UNKNOWN:
            return UNKNOWN
        if id(node) not in self._guarded:
            of = f' {index!r}' if isinstance(node.arg, nodes.Const) else ''
            self._report(f'{self.noun_of(node.node)} has no item{of}')
        return UNKNOWN

    def _report(
        self,
        message: str,
        part: str = '',
        rule: str = 'bad-expression',
        help_text: str | None = None,
    ) -> None:
        self.findings.append(ExpressionFinding(rule, message, part, help_text))


def _operands(node: nodes.Node) -> Iterator[nodes.Node]:
    for each in node.iter_child_nodes():
        if isinstance(each, nodes.Helper):
            yield from _operands(each)
        else:
            yield each


def _formats(node: nodes.Node, operands: list[Any]) -> bool:
    """Return whether a text that only messages know is a format: what it takes is in it."""
    match node:
        case nodes.Mod():
            return isinstance(operands[0], str) and not isinstance(node.left, nodes.Const)
        case nodes.Filter(name='format'):
            return not isinstance(node.node, nodes.Const)
        case nodes.Call(node=nodes.Getattr(attr='format') as method):
            return not isinstance(method.node, nodes.Const)
    return False


def _either(one: Any, other: Any) -> Any:
    """Return a value that stands for both."""
    if isinstance(one, SampleMessage) and isinstance(other, SampleMessage):
        return one if describe_sample(one) == describe_sample(other) else UNKNOWN
    return one if type(one) is type(other) else UNKNOWN


def _noun(value: Any) -> str:
    if isinstance(value, SampleMessage):
        return describe_sample(value).name
    return type(value).__name__
