"""What behaviours may give for a message, as types: `composer_stubs.payloads.<package>`.

A payload is a message, a mapping of fields, or the bare value of a message with one field. A
mapping is a `TypedDict`: `Mapping[str, Any]` would take any key. So one that is built in steps is
declared as the `TypedDict`, or as `Any`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.stubs.field_types import PAYLOADS, FieldTypes, StubImports, is_writable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.interfaces.descriptions import MessageDescription


def write_payloads(package: str, messages: Iterable[MessageDescription]) -> Iterator[str]:
    """Yield the lines of the stub with the payloads of a package's messages."""
    imports = StubImports(f'{PAYLOADS}.{package}')
    lines = [line for message in messages for line in _write_payload(message, imports)]
    yield from imports.lines()
    yield from lines


def _write_payload(message: MessageDescription, imports: StubImports) -> Iterator[str]:
    types = FieldTypes(imports, frozenset(field.name for field in message.fields))
    last = message.name.rpartition('/')[2]
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
