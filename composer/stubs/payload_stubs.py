"""What behaviours may give for a message, as types: `composer_stubs.payloads.<package>`.

A payload is a message, a mapping of fields, or the bare value of a message with one field. Type
checkers hold a mapping that is written out against the fields, and let any other mapping pass.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.stubs.field_types import PAYLOADS, FieldTypes, StubImports, is_writable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.interfaces.descriptions import MessageDescription


def write_payloads(
    package: str, messages: Iterable[MessageDescription], *, takes_any_mapping: bool = True
) -> Iterator[str]:
    """Yield the lines of the stub with the payloads of a package's messages.

    Args:
        takes_any_mapping: Whether a mapping whose keys are not known fits every message.
    """
    imports = StubImports(f'{PAYLOADS}.{package}')
    lines = [
        line
        for message in messages
        for line in _write_payload(message, imports, takes_any_mapping=takes_any_mapping)
    ]
    yield from imports.lines()
    yield from lines


def _write_payload(
    message: MessageDescription, imports: StubImports, *, takes_any_mapping: bool
) -> Iterator[str]:
    types = FieldTypes(imports)
    last = message.name.rpartition('/')[2]
    options = [imports.message(message.name)]
    if all(is_writable(field.name) for field in message.fields):
        typed_dict = imports.take('typing', 'TypedDict')
        yield from ('', f'class {last}Fields({typed_dict}, total=False):')
        if not message.fields:
            yield '    pass'
        for field in message.fields:
            yield f'    {field.name}: {types.payload(field.type)}'
        options.append(f'{last}Fields')
    if takes_any_mapping or len(options) == 1:
        anything = imports.take('typing', 'Any')
        options.append(f'{imports.take("typing", "Mapping")}[str, {anything}]')
    if not message.fields:
        options.append('None')
    if len(message.fields) == 1:
        options.append(types.payload(message.fields[0].type))
    if message.name in ('builtin_interfaces/msg/Time', 'builtin_interfaces/msg/Duration'):
        options.append(f'{imports.support("ToMsg")}[{options[0]}]')
    yield f'{last}: {imports.take("typing", "TypeAlias")} = {" | ".join(options)}'
