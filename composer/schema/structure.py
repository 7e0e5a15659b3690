"""The schema of the language: what it says of data, as findings in the words of the language.

The schema (JSON Schema 2020-12) is the one description of the structure, for editors too.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from itertools import islice, takewhile
from typing import TYPE_CHECKING, Any

from composer.diagnostics import MAX_FINDINGS
from composer.schema import schema_path
from composer.schema.compiler import Acceptor, SchemaCompiler
from composer.schema.explanations import explain

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from composer.diagnostics import Diagnostic
    from composer.schema.violations import StructureFault
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath, Key, SourceMap

# What editors accept in place of a number, a word and the like. Here, the values are in place.
_TEMPLATE = {'$ref': '#/$defs/template'}

# What a file without these keys is read on with, once their absence has been reported.
_REQUIRED: dict[str, Any] = {'version': 1, 'nodes': {}}

# The sections whose entries have keys that count before the schema does; the definitions of these.
_OUTER_SECTIONS = {
    'args': 'argument',
    'nodes': 'node',
    'include': 'include',
    'processes': 'process',
}
_DEPTH_OF_ENTRIES = 3


def check_structure(document: Document) -> None:
    """Check the data of a document against the schema, and drop from them what is wrong.

    What was dropped before, since its expression could not be evaluated, is removed as well. A
    misspelt key is reported and then read as the nearest right one, so that what lies below it is
    checked in the same run. What is wrong with values that depend on samples is dropped, and not
    reported. Of data with more than a thousand errors nothing is left.
    """
    positions, data = document.positions, document.data or {}
    failed = [_entry_of(path) for path in document.dropped]
    if failed or not _schema().accepts(data):
        data = _copied(data)
    _remove_entries(data, failed)
    findings = _mend_keys(data, positions)
    incomplete = {path[:-1] for path in failed}
    faults = _find_faults(data)
    missing = {fault.path for fault in faults if fault.rule == 'missing-key'}
    for fault in faults:
        # What one key needs beside it is missing once, also if its entry needs it anyway.
        known = fault.path in incomplete or (fault.path and fault.path[:-1] in missing)
        if fault.path not in document.sampled_paths and not (
            fault.rule == 'missing-key' and known
        ):
            findings.append(fault.diagnostic(positions))
    document.diagnostics += findings
    if len(findings) >= MAX_FINDINGS:
        document.data, document.dropped = dict(_REQUIRED), set()
    else:
        document.data, document.dropped = data, {*failed, *_drop_faulty(data, faults)}


def correct_outer_keys(document: Document) -> None:
    """Correct misspelt keys that are read before the schema is checked.

    These are the keys of the file, of the declarations of arguments, and `foreach` and `when`.
    """
    data = document.data or {}
    if not all(map(_is_known, _outer_keys(data))):
        document.data = _copied(data)
        document.diagnostics += _mend_keys(document.data, document.positions, _is_outer)


def _outer_keys(data: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the definitions in the schema, '' for the file itself, and keys that they may have."""
    yield from (('', key) for key in data)
    for section, definition in _OUTER_SECTIONS.items():
        entries = data.get(section)
        for entry in entries.values() if isinstance(entries, dict) else ():
            yield from ((definition, key) for key in (entry if isinstance(entry, dict) else ()))


def _is_known(place: tuple[str, str]) -> bool:
    definition, key = place
    return key in _known_keys(definition) or (not definition and key.startswith('x-'))


@cache
def _known_keys(definition: str) -> frozenset[str]:
    document = _schema().document
    schema = document['$defs'][definition] if definition else document
    branches = (schema, *schema.get('oneOf', ()))
    return frozenset(key for branch in branches for key in branch.get('properties', ()))


def _is_outer(path: DataPath, meant: str) -> bool:
    if len(path) == 1:
        return True
    is_entry = len(path) == _DEPTH_OF_ENTRIES and path[0] in _OUTER_SECTIONS
    return is_entry and (path[0] == 'args' or meant in ('foreach', 'when'))


def _mend_keys(
    data: dict[str, Any],
    positions: SourceMap,
    is_wanted: Callable[[DataPath, str], bool] = lambda *_: True,
) -> list[Diagnostic]:
    """Give misspelt keys their right names; return the findings for them."""
    findings: list[Diagnostic] = []
    while len(findings) < MAX_FINDINGS:
        names: dict[DataPath, dict[Key, str]] = {}
        for fault in _find_faults(data):
            if fault.meant is None or not is_wanted(fault.path, fault.meant):
                continue
            parent, key = fault.path[:-1], fault.path[-1]
            renamed = names.setdefault(parent, {})
            if fault.meant not in _value_at(data, parent) and fault.meant not in renamed.values():
                renamed[key] = fault.meant
                findings.append(fault.diagnostic(positions))
                positions.move(fault.path, (*parent, fault.meant))
        if not any(names.values()):
            break
        for path, renamed in names.items():
            _rename_keys(_value_at(data, path), renamed)
    return findings


def _drop_faulty(data: dict[str, Any], faults: list[StructureFault]) -> Iterator[DataPath]:
    """Remove what is wrong, or put something in its place; yield the paths of it."""
    while faults:
        entries = [fault.drop for fault in faults if not fault.stand_in]
        for fault in faults:
            if fault.stand_in:
                key, value = fault.stand_in
                _value_at(data, fault.path)[key] = value
                yield (*fault.path, key)
        yield from entries
        _remove_entries(data, entries)
        for key, value in _REQUIRED.items():
            data.setdefault(key, value)
        faults = _find_faults(data)


def is_sound(part: dict[str, Any]) -> bool:
    """Return whether the schema finds nothing wrong with some top-level keys alone."""
    return not _find_faults(_REQUIRED | part)


def without_templates(schema: Any) -> Any:
    """Return a schema without the alternatives that accept expressions.

    An alternative that is left alone takes the place of its `anyOf`.
    """
    if isinstance(schema, list):
        return [without_templates(item) for item in schema if item != _TEMPLATE]
    if not isinstance(schema, dict):
        return schema
    plain = {key: without_templates(value) for key, value in schema.items()}
    if _TEMPLATE in schema.get('anyOf', ()) and len(plain['anyOf']) == 1:
        (only,) = plain.pop('anyOf')
        plain |= only
    return plain


def _find_faults(data: dict[str, Any]) -> list[StructureFault]:
    """Return the faults of the structure, a thousand at most."""
    if _schema().accepts(data):
        return []
    faults = (fault for error in _validator().iter_errors(data) for fault in explain(error))
    return list(islice(faults, MAX_FINDINGS))


def _copied(data: Any) -> Any:
    """Return a copy in which nothing is shared: aliases and a file included twice share data."""
    if isinstance(data, dict):
        return {key: _copied(value) for key, value in data.items()}
    return [_copied(item) for item in data] if isinstance(data, list) else data


def _value_at(data: Any, path: Sequence[Key]) -> Any:
    for key in path:
        data = data[key]
    return data


def _rename_keys(mapping: dict[Key, Any], names: dict[Key, str]) -> None:
    entries = list(mapping.items())
    mapping.clear()
    mapping.update((names.get(key, key), value) for key, value in entries)


def _entry_of(path: DataPath) -> DataPath:
    """Return the path of the mapping entry that holds a value; items of lists cannot go alone."""
    return tuple(takewhile(lambda key: isinstance(key, str), path))


def _remove_entries(data: Any, paths: Iterable[DataPath]) -> None:
    """Remove entries of nested mappings, also of those in lists, if they are there."""
    for path in paths:
        mapping = data
        for key in path[:-1]:
            mapping = _child(mapping, key)
        if path and isinstance(mapping, dict):
            mapping.pop(path[-1], None)


def _child(data: Any, key: Key) -> Any:
    if isinstance(data, dict):
        return data.get(key)
    is_item = isinstance(data, list) and isinstance(key, int) and key < len(data)
    return data[key] if is_item else None


@dataclass(frozen=True, slots=True)
class _Schema:
    document: dict[str, Any]
    compiler: SchemaCompiler
    accepts: Acceptor


@cache
def _schema() -> _Schema:
    document = without_templates(json.loads(schema_path().read_text(encoding='utf-8')))
    compiler = SchemaCompiler(document['$defs'])
    return _Schema(document, compiler, compiler.compile(document))


@cache
def _validator() -> Any:
    # Importing it takes a fifth of a check's time, and most files have no faults.
    from composer.schema.validator import create_validator

    return create_validator(_schema().document, _schema().compiler)
