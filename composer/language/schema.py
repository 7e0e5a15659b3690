"""The schema of the language: what it says of data, as findings in the words of the language.

The schema (JSON Schema 2020-12) is the one description of the structure, for editors too.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from jsonschema.validators import extend

from composer.language.schema_faults import StructureFault, explain

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.diagnostics import Diagnostic
    from composer.language.positions import DataPath, SourceMap

SCHEMA_NAME = 'composer.schema.json'

# What editors accept in place of a number, a word and the like. Here, the values are in place.
_TEMPLATE = {'$ref': '#/$defs/template'}

# What a file without these keys is read on with, once their absence has been reported.
_REQUIRED: dict[str, Any] = {'version': 1, 'nodes': {}}


def schema_path() -> Path:
    """Return where the schema lies: beside the package in a checkout, inside it in a wheel."""
    packaged = Path(str(resources.files('composer'))) / 'schemas' / SCHEMA_NAME
    return packaged if packaged.exists() else packaged.parents[2] / 'schemas' / SCHEMA_NAME


def check_structure(
    data: dict[str, Any],
    positions: SourceMap,
    failed: Sequence[DataPath] = (),
    sampled: Sequence[DataPath] = (),
) -> tuple[dict[str, Any], frozenset[DataPath], list[Diagnostic]]:
    """Hold data against the schema.

    A misspelt key is reported and then read as the one that was meant, so that what lies below
    it is checked in the same run; `positions` follow it.

    Args:
        failed: The paths of expressions that could not be evaluated; they are left out.
        sampled: The paths of values that only stand for others; what is wrong with them is left
            out as well, and not reported.

    Returns:
        The data without what was wrong, the paths that were dropped for it, and the findings.
    """
    findings: list[Diagnostic] = []
    failed = [_entry_of(path) for path in failed]
    dropped: set[DataPath] = set(failed)
    for path in failed:
        data = _without(data, path)
    faults = _find_faults(data)
    while misspelt := [fault for fault in faults if _can_be_mended(fault, data)]:
        for fault in misspelt:
            if _can_be_mended(fault, data):
                findings.append(fault.diagnostic(positions))
                data = _with_key_renamed(data, fault.path, str(fault.meant))
                positions.move(fault.path, (*fault.path[:-1], str(fault.meant)))
        faults = _find_faults(data)
    incomplete = {path[:-1] for path in failed}
    findings += [
        fault.diagnostic(positions)
        for fault in faults
        if not (
            fault.path in sampled or (fault.rule == 'missing-key' and fault.path in incomplete)
        )
    ]
    while faults:
        for fault in faults:
            if fault.stand_in:
                path = (*fault.path, fault.stand_in[0])
                data = _with_entry(data, path, fault.stand_in[1])
            else:
                path = fault.drop
                data = _without(data, path) if path else data
            dropped.add(path)
        data = _REQUIRED | data
        faults = _find_faults(data)
    return data, frozenset(dropped), findings


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
    return [fault for error in _validator().iter_errors(data) for fault in explain(error)]


def _can_be_mended(fault: StructureFault, data: dict[str, Any]) -> bool:
    """Return whether a fault is a misspelt key whose right spelling is not there as well."""
    if fault.meant is None:
        return False
    mapping: Any = data
    for key in fault.path[:-1]:
        mapping = mapping[key]
    return fault.path[-1] in mapping and fault.meant not in mapping


def _with_key_renamed(data: Any, path: DataPath, key: str) -> Any:
    head, *rest = path
    if not rest:
        return {key if name == head else name: value for name, value in data.items()}
    if isinstance(data, list):
        index = int(head)
        return [
            *data[:index],
            _with_key_renamed(data[index], tuple(rest), key),
            *data[index + 1 :],
        ]
    return data | {head: _with_key_renamed(data[head], tuple(rest), key)}


def _entry_of(path: DataPath) -> DataPath:
    """Return the path of the mapping entry that holds a value; items of lists cannot go alone."""
    return tuple(takewhile(lambda key: isinstance(key, str), path))


def _with_entry(data: Any, path: DataPath, value: Any) -> Any:
    """Return a copy of nested mappings with an entry more, if there is a mapping for it."""
    head, *rest = path
    if not isinstance(data, dict) or (rest and head not in data):
        return data
    return data | {head: _with_entry(data[head], tuple(rest), value) if rest else value}


def _without(data: Any, path: DataPath) -> Any:
    """Return a copy of nested mappings without the entry at `path`, if it is there."""
    head, *rest = path
    if not isinstance(data, dict) or head not in data:
        return data
    if not rest:
        return {key: value for key, value in data.items() if key != head}
    return data | {head: _without(data[head], tuple(rest))}


@cache
def _validator() -> Any:
    schema = json.loads(schema_path().read_text(encoding='utf-8'))
    strict = extend(Draft202012Validator, {'maximum': _check_maximum})
    return strict(without_templates(schema))


def _check_maximum(
    validator: Any, maximum: float, instance: object, _schema: object
) -> Iterator[ValidationError]:
    """As in JSON Schema, but a NaN is beyond every maximum (JSON has none, YAML has)."""
    if validator.is_type(instance, 'number') and not instance <= maximum:  # type: ignore[operator]
        yield ValidationError(f'{instance!r} is greater than the maximum of {maximum!r}')
