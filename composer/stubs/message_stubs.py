"""Interface packages as stubs: a class for each message, with its fields and constants.

They describe what rosidl_generator_py generates: keyword-only constructors, a property for each
field, constants of the class, and the parts of services and actions as inner names.
"""

from __future__ import annotations

import keyword
from typing import TYPE_CHECKING

from composer.interfaces.field_values import INTEGER_RANGES, OCTET_KINDS
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.interfaces.catalogue import InterfaceCatalogue, InterfaceKind
    from composer.interfaces.descriptions import (
        FieldType,
        InterfaceDescription,
        MessageDescription,
    )

SUPPORT = 'composer_stubs'
PAYLOADS = f'{SUPPORT}.payloads'

_BUILTINS = ('bool', 'bytes', 'float', 'int', 'list', 'property', 'str', 'tuple')
_FLOATS = ('float32', 'float64')
_STRINGS = ('string', 'wstring')


def is_writable(name: str) -> bool:
    """Return whether a field can be written as an attribute."""
    return name.isidentifier() and not keyword.iskeyword(name)


class StubImports:
    """The names of other modules that a stub uses; aliases with `_` are not part of its own."""

    def __init__(self, module: str) -> None:
        self.module = module
        self._lines: set[str] = set()

    def message(self, full_name: str) -> str:
        """Return how the stub names the class of an interface, or of a part of one."""
        package, kind, name = full_name.split('/')
        return self.of(f'{package}.{kind}', name)

    def payload(self, full_name: str) -> str:
        """Return how the stub names what may be given for a message."""
        package, _, name = full_name.split('/')
        return self.of(f'{PAYLOADS}.{package}', name)

    def support(self, name: str) -> str:
        """Return how the stub names a type that all stubs share."""
        return self.take(SUPPORT, name)

    def take(self, module: str, name: str) -> str:
        """Return how the stub names something of a module of Python."""
        self._lines.add(f'from {module} import {name} as _{name}')
        return f'_{name}'

    def lines(self) -> list[str]:
        """Return the statements that import all this."""
        return sorted(self._lines)

    def of(self, module: str, name: str) -> str:
        """Return how the stub names a class of a module."""
        if module == self.module:
            return name
        alias = '_' + module.removeprefix(f'{SUPPORT}.').replace('.', '_')
        self._lines.add(f'import {module} as {alias}')
        return f'{alias}.{name}'


@record
class FieldTypes:
    """Writes types of fields in a stub.

    Attributes:
        hidden: The names that have another meaning in the class, as a field `list` has.
    """

    imports: StubImports
    hidden: frozenset[str] = frozenset()

    def word(self, name: str) -> str:
        """Return how a built-in type is written."""
        if name not in self.hidden or name not in _BUILTINS:
            return name
        return self.imports.take('builtins', name)

    def read(self, field_type: FieldType) -> str:
        """Return the type of a field's value in a message that came or was created."""
        item = self._value(field_type)
        if field_type.array is None:
            return item
        if field_type.kind not in _FLOATS and field_type.kind not in _ARRAY_INTEGERS:
            return f'{self.word("list")}[{item}]'
        if field_type.array != 'fixed':
            return f'{self.imports.take("array", "array")}[{item}]'
        kind = 'uint8' if field_type.kind == 'char' else field_type.kind
        array = self.imports.take('numpy.typing', 'NDArray')
        return f'{array}[{self.imports.take("numpy", kind)}]'

    def write(self, field_type: FieldType) -> str:
        """Return the type of what a message's field takes, which converts no single value."""
        if field_type.array is None:
            if field_type.kind in _FLOATS:
                return self.imports.support('PythonFloat')
            is_byte = field_type.kind == 'byte'
            return self._value(field_type) if is_byte else self._taken(field_type)
        item = self._taken(field_type)
        if field_type.kind in _FLOATS or field_type.kind in _ARRAY_INTEGERS:
            return f'{self.imports.take("typing", "Iterable")}[{item}]'
        a_set = self.imports.take('typing', 'AbstractSet')
        return f'{self.imports.support("Items")}[{item}] | {a_set}[{item}]'

    def bare(self, field_type: FieldType) -> str:
        """Return the type of what stands for a message that has only this field."""
        if field_type.nested is None or field_type.array is not None:
            return self.payload(field_type)
        return f'{self.imports.payload(field_type.nested)}Value'

    def payload(self, field_type: FieldType) -> str:
        """Return the type of what a payload may hold for a field."""
        if field_type.nested is None:
            item = self._taken(field_type)
        else:
            item = self.imports.payload(field_type.nested)
        if field_type.array is None:
            return item
        items = f'{self.imports.support("Items")}[{item}]'
        if field_type.nested is not None:
            # mypy reads the mappings in a tuple as those of the message only where it says so.
            items = f'{items} | {self.word("tuple")}[{item}, ...]'
        octets = ' | bytes | bytearray | memoryview' if field_type.kind in OCTET_KINDS else ''
        return f'{items}{octets}'

    def _value(self, field_type: FieldType) -> str:
        if field_type.nested is not None:
            return self.imports.message(field_type.nested)
        if field_type.kind in _STRINGS:
            return self.word('str')
        if field_type.kind == 'byte':
            return self.word('bytes')
        if field_type.kind in _FLOATS:
            return self.word('float')
        return self.word('int' if field_type.kind in INTEGER_RANGES else 'bool')

    def _taken(self, field_type: FieldType) -> str:
        value = self._value(field_type)
        if field_type.nested is not None or field_type.kind in _STRINGS:
            return value
        if field_type.kind == 'byte':
            return f'{value} | {self.word("int")}'
        # An `int` is a `float` to type checkers, and to payloads.
        return f'{value} | {self.imports.support("NumPyScalar")}'


# Those of which rclpy keeps an `array.array`, or a NumPy array.
_ARRAY_INTEGERS = frozenset(INTEGER_RANGES) - {'byte'}


_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
# The parts of services and actions that behaviours name; of the other ones, nothing is said.
PARTS_OF_KINDS = {'srv': ('Request', 'Response'), 'action': ('Goal', 'Result', 'Feedback')}
_OTHERS = {'srv': 'Event', 'action': 'Impl'}


def write_packages(
    packages: Iterable[str], catalogue: InterfaceCatalogue
) -> Iterator[tuple[str, list[str]]]:
    """Yield the path and the lines of each stub of packages, and of those that they use.

    Packages that do not exist are left out.
    """
    done: set[str] = set()
    pending = [*packages]
    while pending:
        package = pending.pop()
        if package in done:
            continue
        done.add(package)
        names = [name for kind in _KINDS for name in catalogue.names(kind, package)]
        interfaces = {name: catalogue.describe(name) for name in names}
        if interfaces:
            fields = [field for part in _parts(interfaces) for field in part.fields]
            pending += [
                field.type.nested.partition('/')[0] for field in fields if field.type.nested
            ]
            yield from _write_package(package, interfaces)


def _write_package(
    package: str, interfaces: Mapping[str, InterfaceDescription | None]
) -> Iterator[tuple[str, list[str]]]:
    yield f'{package}/__init__.pyi', []
    for kind in _KINDS:
        imports = StubImports(f'{package}.{kind}')
        lines = [
            line
            for name, interface in interfaces.items()
            if name.startswith(f'{package}/{kind}/')
            for line in _write_interface(name, interface, imports)
        ]
        if lines:
            yield f'{package}/{kind}/__init__.pyi', [*imports.lines(), *lines]
    imports = StubImports(f'{PAYLOADS}.{package}')
    lines = [line for part in _parts(interfaces) for line in _write_payload(part, imports)]
    yield f'composer_stubs/payloads/{package}.pyi', [*imports.lines(), *lines]


def _parts(
    interfaces: Mapping[str, InterfaceDescription | None],
) -> Iterator[MessageDescription]:
    """Yield the messages, and those that services and actions have."""
    for interface in interfaces.values():
        yield from interface.parts if interface is not None else ()


def _write_interface(
    name: str, interface: InterfaceDescription | None, imports: StubImports
) -> Iterator[str]:
    if interface is None:
        yield from ('', f'{_last(name)}: {imports.take("typing", "Any")}')
        return
    for message in interface.parts:
        yield from _write_message(message, imports)
    _, kind, last = name.split('/')
    if kind in PARTS_OF_KINDS:
        alias, anything = imports.take('typing', 'TypeAlias'), imports.take('typing', 'Any')
        yield from ('', f'class {last}:')
        yield from (f'    {part}: {alias} = {last}_{part}' for part in PARTS_OF_KINDS[kind])
        yield f'    {_OTHERS[kind]}: {anything}'


def _write_message(message: MessageDescription, imports: StubImports) -> Iterator[str]:
    fields = [field for field in message.fields if is_writable(field.name)]
    constants = [constant.name for constant in message.constants]
    names = frozenset([*constants, *(field.name for field in fields)])
    types = FieldTypes(imports, names)
    text, anything = types.word('str'), imports.take('typing', 'Any')
    yield from ('', f'class {_last(message.name)}:')
    if message.comment:
        yield f'    {" ".join(message.comment.split())!r}'
    of_class = imports.take('typing', 'ClassVar')
    for constant in filter(lambda each: is_writable(each.name), message.constants):
        yield f'    {constant.name}: {of_class}[{types.read(constant.type)}]'
    yield f'    SLOT_TYPES: {of_class}[tuple[{anything}, ...]]'
    yield '    def __init__('
    yield '        self,'
    yield '        *,'
    yield from (f'        {field.name}: {types.write(field.type)} = ...,' for field in fields)
    yield f'        check_fields: {types.word("bool")} | None = ...,'
    yield '    ) -> None: ...'
    for field in fields:
        yield f'    @{types.word("property")}'
        yield f'    def {field.name}(self) -> {types.read(field.type)}:'
        yield f'        {" ".join(field.comment.split())!r}' if field.comment else '        ...'
        yield f'    @{field.name}.setter'
        yield f'    def {field.name}(self, value: {types.write(field.type)}) -> None: ...'
        if field.default is not None:
            yield f'    {field.name.upper()}__DEFAULT: {of_class}[{types.read(field.type)}]'
    yield '    @classmethod'
    yield f'    def get_fields_and_field_types(cls) -> dict[{text}, {text}]: ...'


def _last(name: str) -> str:
    return name.rpartition('/')[2]


def _write_payload(message: MessageDescription, imports: StubImports) -> Iterator[str]:
    """Yield the lines with what may be given for a message.

    That is a message, a mapping of fields, or the bare value of a message with one field. A
    mapping is a `TypedDict`: `Mapping[str, Any]` would take any key. So one that is built in steps
    is declared as the `TypedDict`, or as `Any`.
    """
    types = FieldTypes(imports, frozenset(field.name for field in message.fields))
    last = _last(message.name)
    message_class = imports.message(message.name)
    # A mapping names the fields of the message itself, so a bare value for its one field is none.
    values = [message_class, f'{imports.support("ToMsg")}[{message_class}]']
    if not message.fields:
        values.append('None')
    if len(message.fields) == 1:
        values.append(types.bare(message.fields[0].type))
    alias = imports.take('typing', 'TypeAlias')
    yield from ('', f'{last}Value: {alias} = {" | ".join(values)}')
    if all(is_writable(field.name) for field in message.fields):
        typed_dict = imports.take('typing', 'TypedDict')
        yield f'class {last}Fields({typed_dict}, total=False):'
        if not message.fields:
            yield '    pass'
        for field in message.fields:
            yield f'    {field.name}: {types.payload(field.type)}'
    else:
        anything = imports.take('typing', 'Any')
        yield f'{last}Fields: {alias} = {imports.take("typing", "Mapping")}[str, {anything}]'
    yield f'{last}: {alias} = {last}Value | {last}Fields'
