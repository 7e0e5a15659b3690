"""Payloads: whether what a behaviour gives away can become a message of the type it has to be."""

from __future__ import annotations

import ast
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.library.known_functions import KNOWN_RESULTS
from composer.inference.evaluation.operators import explain_unset
from composer.inference.evaluation.part import Part
from composer.inference.message_types import PYTHON_TYPES, in_python
from composer.inference.values import (
    Alternatives,
    ArrayField,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    External,
    Function,
    Generated,
    Instance,
    Mapping,
    Message,
    MessageClass,
    NodeValue,
    Partial,
    PartOfNode,
    Place,
    ProjectModule,
    Scalar,
    Sequence,
    Value,
    alternatives,
    is_none,
    join,
)
from composer.interfaces.field_errors import (
    FieldError,
    format_field_error,
    no_message,
    unknown_field,
)
from composer.interfaces.field_values import (
    INTEGER_RANGES,
    OCTET_KINDS,
    check_length,
    read_items,
    scalar_reader,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.inference.message_types import MessageTypes
    from composer.interfaces.descriptions import FieldDescription, FieldType, MessageDescription

_FLOATS = ('float32', 'float64')
_TEXTS = ('string', 'wstring')
_UNORDERED: tuple[type, ...] = (
    set,
    frozenset,
    type({}.keys()),
    type({}.values()),
    type({}.items()),
)


@record
class Misfit(Part):
    """A value that does not fit, and where it is written.

    Attributes:
        used_at: Where it is put into a payload, if it is written elsewhere.
    """

    rule: str
    message: str
    place: Place
    help: str | None = None
    used_at: Place | None = None


class Payloads(Part):
    """Checks payloads.

    Of several values that one name may stand for, each may be meant for another place: one is
    reported if it fits none of those that it is given to.
    """

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._misfits: dict[int, tuple[object, list[Misfit], Place]] = {}
        self._fitting: set[int] = set()

    def check(self, type_name: str | None, value: Value, place: Place) -> None:
        """Check what becomes a message: a message, a mapping or a bare value."""
        if type_name is None:
            return
        fit = _Fit(type_name, self._evaluator.run.types)
        self._settle(
            fit.any_of(value, lambda each: fit.message(type_name, each, place, ())), fit, place
        )

    def check_field(
        self, type_name: str, field: FieldDescription, value: Value, place: Place
    ) -> None:
        """Check what a field of a message is to hold."""
        fit = _Fit(type_name, self._evaluator.run.types, is_stored=True)
        path = (field.name,)
        found = fit.any_of(value, lambda each: fit.field(field.type, each, place, path))
        self._settle(found, fit, place)

    def check_item(self, item_type: FieldType, value: Value, place: Place) -> None:
        """Check what an array of a message is to hold."""
        fit = _Fit('', self._evaluator.run.types)
        found = fit.any_of(value, lambda each: fit.field(item_type, each, place, ()))
        self._settle(found, fit, place)

    def check_keywords(self, function: Value, value: Value, place: Place) -> None:
        """Check one of several mappings that a message is made with: `Twist(**TABLE[key])`."""
        several = [each for each in alternatives(value) if isinstance(each, Mapping)]
        if isinstance(function, MessageClass):
            self.check(function.type, join(several), place)
        else:
            # It may be meant for this.
            self._fitting.update(map(id, several))

    def _settle(self, found: list[Misfit], fit: _Fit, place: Place) -> None:
        if self._evaluator.run.is_silent:
            return
        for misfit in found:
            self._report(misfit, place)
        for value, misfits in fit.alternatives:
            if misfits:
                self._misfits.setdefault(id(value), (value, misfits, place))
            else:
                self._fitting.add(id(value))

    def _report(self, misfit: Misfit, place: Place) -> None:
        self._evaluator.run.report(
            misfit.rule,
            misfit.place,
            misfit.message,
            misfit.help,
            used_at=misfit.used_at or place,
            is_of_payload=misfit.rule == 'unknown-field',
        )

    def fits(self, type_name: str | None, value: Value, place: Place) -> bool:
        """Return whether a value may become a message of a type."""
        if type_name is None:
            return True
        fit = _Fit(type_name, self._evaluator.run.types)
        return not fit.any_of(value, lambda each: fit.message(type_name, each, place, ()))

    def report_unfit(self) -> None:
        """Report the values that fitted nowhere."""
        for key, (_, misfits, place) in self._misfits.items():
            if key not in self._fitting:
                for misfit in misfits:
                    self._report(misfit, place)


class _Fit:
    """Compares values with the types of a message.

    Attributes:
        alternatives: Dictionaries and lists that are one of several, and what is wrong in each.
        is_stored: Whether rclpy stores them as they are: it sends a whole number in a field for
            a float as another number.
    """

    def __init__(self, root: str, types: MessageTypes, *, is_stored: bool = False) -> None:
        self.root = root
        self.is_stored = is_stored
        self.types = types
        self.alternatives: list[tuple[Value, list[Misfit]]] = []

    def any_of(self, value: Value, compare: Callable[[Value], Iterator[Misfit]]) -> list[Misfit]:
        """Return what is wrong in a value; if it is one of several, in all of them."""
        several = alternatives(value)
        found = [list(compare(each)) for each in several]
        if isinstance(value, Alternatives) and value.is_direct:
            return [misfit for misfits in found for misfit in misfits]
        if all(found):
            return found[0]
        for each, misfits in zip(several, found, strict=True):
            if is_none(each) and _is_end(each):
                # Where a helper comes to its end, nobody has thought of it.
                return misfits
            if isinstance(each, Mapping | Sequence):
                self.alternatives.append((each, misfits))
        return []

    def message(
        self, type_name: str, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        description = self.types.describe(type_name)
        if description is None:
            return
        match value:
            case Message():
                yield from self._other_message(description, value, place, path)
            case Mapping() if not value.is_lost:
                yield from self._entries(description, value, path)
            case PartOfNode(name='time' | 'duration' as part) if self.is_stored:
                text = f'expected {in_python(type_name)}, got a {part} of rclpy'
                yield self._misfit('field-type', text, place, path, 'write .to_msg()')
            case PartOfNode(name='time' | 'duration' as part):
                stamp = Message(f'builtin_interfaces/msg/{part.title()}')
                yield from self._other_message(description, stamp, place, path)
            case Mapping():
                return
            case _ if _is_no_value(value):
                yield from self._bare(description, value, place, path)
            case Constant() | Scalar() | Sequence() | ArrayField() | PartOfNode():
                yield from self._bare(description, value, place, path)

    def _other_message(
        self,
        description: MessageDescription,
        value: Message,
        place: Place,
        path: tuple[str | int, ...],
    ) -> Iterator[Misfit]:
        fields = description.fields
        if self.types.are_alike(value.type, description.name):
            return
        if len(fields) == 1 and fields[0].type.nested:
            yield from self.field(fields[0].type, value, place, (*path, fields[0].name))
            return
        error = no_message(description.name, None, [field.name for field in fields])
        text = f'expected {in_python(description.name)}, got {in_python(value.type)}'
        yield self._misfit('field-type', text, place, path, error.help)

    def _entries(
        self, description: MessageDescription, value: Mapping, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        names = [field.name for field in description.fields]
        for key, (held, place) in value.entries.items():
            field = description.field(key) if isinstance(key, str) else None
            if field is None:
                error = unknown_field(description.name, key, names)
                yield self._misfit('unknown-field', str(error), place, path, error.help)
                continue
            within = (*path, field.name)
            yield from self.any_of(held, self._field_reader(field.type, place, within))

    def _bare(
        self,
        description: MessageDescription,
        value: Value,
        place: Place,
        path: tuple[str | int, ...],
    ) -> Iterator[Misfit]:
        """Compare the bare value of a message with a single field."""
        fields = description.fields
        if len(fields) == 1:
            yield from self.field(fields[0].type, value, place, (*path, fields[0].name))
        elif fields or not is_none(value):
            error = no_message(description.name, None, [field.name for field in fields])
            text = f'expected {in_python(description.name)}, got {_shown(value)}'
            yield self._misfit('field-type', text, place, path, error.help)

    def _field_reader(
        self, field_type: FieldType, place: Place, path: tuple[str | int, ...]
    ) -> Callable[[Value], Iterator[Misfit]]:
        return lambda value: self.field(field_type, value, place, path)

    def field(
        self, field_type: FieldType, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        """Yield what keeps a value from being held by a field."""
        origin = getattr(value, 'origin', None)
        if origin is not None:
            for misfit in self._compare(field_type, value, origin, path):
                yield misfit if misfit.used_at else replace(misfit, used_at=place)
        else:
            yield from self._compare(field_type, value, place, path)

    def _compare(
        self, field_type: FieldType, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        if isinstance(value, Awaitable):
            text = 'this is a coroutine, which has not been awaited'
            yield self._misfit('missing-await', text, place, path, 'put await before the call')
        elif field_type.array:
            yield from self._array(field_type, value, place, path)
        elif field_type.nested:
            yield from self.message(field_type.nested, value, place, path)
        else:
            yield from self._scalar(field_type, value, place, path)

    def _array(
        self, field_type: FieldType, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        match value:
            case Sequence() if not value.is_lost and value.kind not in _UNORDERED:
                if not value.is_open:
                    yield from self._tried(
                        lambda: check_length(field_type, len(value.items)), place, path
                    )
                for index, (item, where) in enumerate(value.items):
                    reader = self._field_reader(field_type.item, where, (*path, index))
                    yield from self.any_of(item, reader)
            case Constant():
                yield from self._tried(lambda: read_items(field_type, value.value), place, path)
            case Scalar(kind=kind) if kind is list or (
                kind is bytes and field_type.kind in OCTET_KINDS
            ):
                return
            case Scalar():
                yield self._wrong(field_type, value, place, path)
            case ArrayField():
                is_text = field_type.kind in _TEXTS, value.type.kind in _TEXTS
                nested = field_type.nested, value.type.nested
                kinds = field_type.kind, value.type.kind
                is_number = not value.type.nested and 'byte' not in kinds
                given = PYTHON_TYPES.get(value.type.kind, int)
                if value.type.array == 'fixed':
                    size = value.type.array_bound or 0
                    yield from self._tried(lambda: check_length(field_type, size), place, path)
                if (
                    is_text[0] != is_text[1]
                    or (is_number and not _may_hold(field_type.kind, given))
                    or (nested[0] is None) != (nested[1] is None)
                    or (nested[0] and nested[1] and not self.types.are_alike(nested[0], nested[1]))
                ):
                    yield self._wrong(field_type, value, place, path)
            case Message() | Mapping() | Sequence() | Generated():
                if not getattr(value, 'is_lost', False):
                    yield self._wrong(field_type, value, place, path)

    def _scalar(
        self, field_type: FieldType, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Iterator[Misfit]:
        match value:
            case Constant() | Scalar() if (
                self.is_stored and field_type.kind == 'byte' and value.kind is int
            ):
                text = f'expected {field_type}, got {_shown(value)}'
                yield self._misfit('field-type', text, place, path, "rclpy takes bytes: b'\\x01'")
            case Constant() | Scalar() if self.is_stored and _is_whole(field_type, value):
                text = f'expected {field_type}, got {_shown(value)}'
                yield self._misfit('field-type', text, place, path, 'write it as a float: 1.0')
            case Constant():
                yield from self._tried(lambda: scalar_reader(field_type)(value.value), place, path)
            case Scalar() if value.unset and _may_hold(field_type.kind, value.kind):
                text, help_text = explain_unset(value.unset)
                yield self._misfit('no-value', text, place, path, help_text)
            case Scalar():
                if not _may_hold(field_type.kind, value.kind):
                    yield self._wrong(field_type, value, place, path)
            case _ if _is_no_value(value):
                yield self._wrong(field_type, value, place, path)
            case Message() | ArrayField() | Mapping() | Sequence() | PartOfNode():
                if not getattr(value, 'is_lost', False):
                    yield self._wrong(field_type, value, place, path)

    def _tried(self, read: object, place: Place, path: tuple[str | int, ...]) -> Iterator[Misfit]:
        try:
            read()  # type: ignore[operator]
        except FieldError as error:
            yield self._misfit(error.rule, str(error), place, path, error.help)

    def _wrong(
        self, expected: FieldType, value: Value, place: Place, path: tuple[str | int, ...]
    ) -> Misfit:
        text = f'expected {expected}, got {_shown(value)}'
        return self._misfit('field-type', text, place, path)

    def _misfit(
        self,
        rule: str,
        text: str,
        place: Place,
        path: tuple[str | int, ...],
        help_text: str | None = None,
    ) -> Misfit:
        message = format_field_error(self.root, path, text)
        return Misfit(rule, message.replace(self.root, in_python(self.root)), place, help_text)


def _is_end(value: Value) -> bool:
    origin = getattr(value, 'origin', None)
    return origin is not None and isinstance(origin.node, ast.FunctionDef)


def _may_hold(kind: str, given: type) -> bool:
    """Return whether a field of a kind may hold some value of a type of Python."""
    if kind in _FLOATS:
        return given in (int, float)
    if kind in _TEXTS:
        return given is str
    if kind == 'bool':
        return given is bool
    return given is int or (kind == 'byte' and given is bytes and kind in INTEGER_RANGES)


def _is_whole(field_type: FieldType, value: Constant | Scalar) -> bool:
    return field_type.kind in _FLOATS and value.kind is int and not getattr(value, 'member', None)


def _is_no_value(value: Value) -> bool:
    """Return whether a value is a function or the like, or a member of a plain enumeration."""
    if isinstance(value, External):
        return value.name in KNOWN_RESULTS
    if isinstance(value, Instance):
        return value.is_no_value
    if isinstance(value, BoundMethod):
        kind = getattr(value.owner, 'kind', None)
        is_builtin = isinstance(kind, type) and callable(getattr(kind, value.name, None))
        return is_builtin or isinstance(value.owner, NodeValue) or value.name == 'to_msg'
    return isinstance(value, Function | Class | MessageClass | Partial | ProjectModule | NodeValue)


def _shown(value: Value) -> str:
    """Return a value in a few words."""
    match value:
        case Function(definition=ast.FunctionDef() | ast.AsyncFunctionDef() as definition):
            return f"the function '{definition.name}'"
        case BoundMethod(name=name):
            return f"the method '{name}', which is not called"
        case Function() | Partial() | External():
            return 'a function'
        case Class() | MessageClass():
            return 'a class'
        case ProjectModule():
            return 'a module'
        case Instance():
            return f"a member of {value.of.definition.name}, and not its 'value'"
        case NodeValue():
            return 'the node'
        case Constant():
            return 'None' if value.value is None else f'{value.kind.__name__} {value.value!r}'
        case Scalar():
            return value.kind.__name__
        case Message():
            return in_python(value.type)
        case ArrayField():
            return f'an array: {value.type}'
        case Mapping():
            return 'dict'
        case Sequence():
            return value.kind.__name__
        case Generated():
            return 'a generator, and no list'
        case PartOfNode():
            return f'a {value.name}'
    return type(value).__name__
