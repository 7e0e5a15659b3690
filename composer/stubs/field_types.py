"""The Python types of fields: what is read of a message, what it takes, and what payloads hold."""

from __future__ import annotations

import keyword
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.interfaces.field_values import INTEGER_RANGES, OCTET_KINDS
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.interfaces.descriptions import FieldType

SUPPORT = 'composer_stubs'
PAYLOADS = f'{SUPPORT}.payloads'

_BUILTINS = ('bool', 'bytes', 'float', 'int', 'list', 'property', 'str', 'tuple')
_FLOATS = ('float32', 'float64')
_STRINGS = ('string', 'wstring')


def is_writable(name: str) -> bool:
    """Return whether a field can be written as an attribute."""
    return name.isidentifier() and not keyword.iskeyword(name)


@dataclass(slots=True)
class StubImports:
    """The names of other modules that a stub uses; aliases with `_` are not part of its own.

    Attributes:
        module: The dotted name of the module that the stub describes.
    """

    module: str
    _lines: set[str] = field(default_factory=set)

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

    def lines(self) -> Iterable[str]:
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
