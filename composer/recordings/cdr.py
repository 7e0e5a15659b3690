"""Writes messages in CDR, as the middleware does, in a fraction of its time.

rclpy copies a message into a structure of C, and has the middleware write that. What is not
written here goes that way: an array of messages or texts, a `wstring`, a text with a NUL, a value
that does not fit. Gaps are zero; the middleware leaves in them what was in its memory before.

Source: the OMG's "DDS Interoperability Wire Protocol" 2.5, 10.2.1, and Fast CDR, its library.
"""

from __future__ import annotations

import struct
import sys
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.errors import ComposerError
from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface
from composer.runtime.messages.arrays import TYPE_CODES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from composer.interfaces.descriptions import FieldType

    # Writes a value at an offset; returns the offset after it.
    _Write = Callable[[Any, list[bytes], int], int]

_HEADER: Final = b'\0\1\0\0'
_LARGEST: Final = 8
# As `struct` names what it packs. Arrays of those that `array` has not are lists.
_CODES: Final = {**TYPE_CODES, 'bool': '?', 'byte': 'c'}


class _OtherwiseError(Exception):
    """Something is not written here."""


@cache
def serializer_of(message_class: type) -> Callable[[Any], bytes]:
    """Return what serializes messages of a class of `import_interface`.

    It raises what rclpy raises.
    """

    def serialize_by_rclpy(message: Any) -> bytes:
        return bytes(_rclpy.rclpy_serialize(message, message_class))

    try:
        steps = list(_steps(message_class))
    except (ComposerError, _OtherwiseError):
        return serialize_by_rclpy

    def serialize(message: Any) -> bytes:
        parts, offset = [_HEADER], 0
        try:
            for find, write in steps:
                offset = write(find(message), parts, offset)
        except Exception:  # noqa: BLE001 - what is wrong is for rclpy to say
            return serialize_by_rclpy(message)
        return b''.join(parts)

    return serialize if sys.byteorder == 'little' else serialize_by_rclpy


def _steps(message_class: type) -> Iterator[tuple[attrgetter[Any], _Write]]:
    """Yield what finds and what writes the values of a message: numbers that follow at once."""
    names, codes = [], ''
    for name, type_ in [*_leaves(message_class), ('', None)]:
        if type_ is not None and type_.array is None and type_.kind in _CODES:
            names.append(name)
            codes += _CODES[type_.kind]
            continue
        if codes:
            yield attrgetter(*names), _numbers(codes)
            names, codes = [], ''
        if type_ is not None:
            yield attrgetter(name), _writer_of(type_)


def _leaves(message_class: type, prefix: str = '') -> Iterator[tuple[str, FieldType]]:
    """Yield the way to each value, through the messages in the message, and its type."""
    fields = describe_class(message_class).fields
    if not fields:
        raise _OtherwiseError
    for field in fields:
        name = f'{prefix}_{field.name}'
        if field.type.nested and field.type.array is None:
            yield from _leaves(import_interface(field.type.nested), f'{name}.')
        else:
            yield name, field.type


def _writer_of(type_: FieldType) -> _Write:
    kind, is_fixed = type_.kind, type_.array == 'fixed'
    if kind == 'string' and type_.array is None:
        return _write_text
    if kind in TYPE_CODES:
        write = _array(struct.calcsize(f'={TYPE_CODES[kind]}'))
    elif kind in _CODES:
        write = _listed(_CODES[kind])
    else:
        raise _OtherwiseError

    def write_counted(values: Sequence[Any], parts: list[bytes], offset: int) -> int:
        return write(values, parts, _write_count(len(values), parts, offset))

    return write if is_fixed else write_counted


def _numbers(codes: str) -> _Write:
    packers, is_one = _packers(codes), not codes[1:]

    def write(values: Any, parts: list[bytes], offset: int) -> int:
        packer = packers[offset % _LARGEST]
        parts.append(packer.pack(values) if is_one else packer.pack(*values))
        return offset + packer.size

    return write


def _packers(codes: str) -> list[struct.Struct]:
    """Return what packs numbers at each offset modulo eight: each is aligned to its size."""
    packers = []
    for start in range(_LARGEST):
        offset, padded = start, '='
        for code in codes:
            size = struct.calcsize(f'={code}')
            gap = -offset % size
            padded += 'x' * gap + code
            offset += gap + size
        packers.append(struct.Struct(padded))
    return packers


_write_count: Final = _numbers(_CODES['uint32'])


def _write_text(text: str, parts: list[bytes], offset: int) -> int:
    data = text.encode()
    if b'\0' in data:
        # rclpy ends the text there.
        raise _OtherwiseError
    count = len(data) + 1
    offset = _write_count(count, parts, offset)
    parts += data, b'\0'
    return offset + count


def _listed(code: str) -> _Write:
    def write(values: Sequence[Any], parts: list[bytes], offset: int) -> int:
        data = struct.pack(f'={code * len(values)}', *values)
        parts.append(data)
        return offset + len(data)

    return write


def _array(size: int) -> _Write:
    def write(values: Any, parts: list[bytes], offset: int) -> int:
        gap, data = -offset % size, values.tobytes()
        parts += bytes(gap), data
        return offset + gap + len(data)

    return write
