"""Checks data against the schema, and returns findings in the words of the language.

The schema (JSON Schema 2020-12) is the one description of the structure, for editors too.
"""

from __future__ import annotations

import json
from functools import cache, cached_property
from itertools import islice, takewhile
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import KIND_OF_SECTION
from composer.input_limits import MAX_FINDINGS
from composer.schema import SCHEMA_NAME, schema_path
from composer.schema.explanations import explain
from composer.yaml_text.document import copy_data

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from jsonschema.exceptions import ValidationError
    from jsonschema_rs import Validator

    from composer.diagnostics import Diagnostic
    from composer.schema.violations import Violation
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath, Key, SourceMap

# Editors accept an expression in place of a value; here, expressions are evaluated already.
_TEMPLATE = {'$ref': '#/$defs/template'}
# The values for missing keys of the file, once they are reported.
_REQUIRED: dict[str, Any] = {'version': 1, 'nodes': {}}
# Sections whose entries have keys that count before the check, and their definitions.
_OUTER_SECTIONS = {
    'args': 'argument',
    'nodes': 'node',
    'include': 'include',
    'processes': 'process',
    'containers': 'container',
    'workers': 'worker',
    'hosts': 'host',
}
_DEPTH_OF_ENTRIES = 3
_DEPTH_OF_ENTITIES = 5
_ROOT = '#'


def check_structure(document: Document) -> None:
    """Check the data of a document against the schema, and drop what is not valid.

    What was dropped before, because its expression could not be evaluated, is removed as well. A
    misspelt key is reported and then read as the nearest known one: what stands below it is
    checked in the same run. Sample values that are not valid are dropped without a finding. Of
    data with more than a thousand findings nothing is left.
    """
    positions, data = document.positions, document.data or {}
    failed = [_entry_of(path) for path in document.dropped]
    if not failed and _schema(SCHEMA_NAME).is_surely_valid(data):
        document.data, document.dropped = data, set()
        return
    data = copy_data(data)
    _remove_entries(data, failed)
    findings = _correct_keys(data, positions)
    incomplete = {path[:-1] for path in failed}
    violations = _find_violations(data)
    missing = {violation.path for violation in violations if violation.rule == 'missing-key'}
    for violation in violations:
        # A key that is missing twice, for its entry and for another key, is reported once.
        known = violation.path in incomplete or (violation.path and violation.path[:-1] in missing)
        if violation.path not in document.sampled_paths and not (
            violation.rule == 'missing-key' and known
        ):
            findings.append(violation.diagnostic(positions))
    document.diagnostics += findings
    if len(findings) >= MAX_FINDINGS:
        document.data, document.dropped = dict(_REQUIRED), set()
    else:
        document.data, document.dropped = data, {*failed, *_drop_invalid(data, violations)}


def check_keys_and_values(document: Document, schema_name: str) -> set[DataPath]:
    """Check data of a file that is not a system; return the paths of what is not valid.

    Misspelt keys are reported, and then read as those that were meant; other data stay.
    """
    if document.data is None:
        return set()
    document.data = copy_data(document.data)
    document.diagnostics += _correct_keys(document.data, document.positions, schema=schema_name)
    violations = _find_violations(document.data, schema_name)
    document.diagnostics += [each.diagnostic(document.positions) for each in violations]
    return {each.path for each in violations}


def correct_outer_keys(document: Document) -> None:
    """Correct misspelt keys that are read before the check against the schema.

    These are the keys of the file, of the declarations of arguments, `foreach` and `when`, and the
    sections of nodes, in which these may stand, too.
    """
    data = document.data or {}
    if not all(map(_is_known, _outer_keys(data))):
        document.data = copy_data(data)
        document.diagnostics += _correct_keys(document.data, document.positions, _is_outer)


def _outer_keys(data: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the keys of the file and of outer entries, after their definitions in the schema."""
    yield from (('', key) for key in data)
    for section, definition in _OUTER_SECTIONS.items():
        entries = data.get(section)
        for entry in entries.values() if isinstance(entries, dict) else ():
            if isinstance(entry, dict):
                yield from ((definition, key) for key in entry)
                yield from _keys_of_entities(entry) if section == 'nodes' else ()


def _keys_of_entities(node: dict[str, Any]) -> Iterator[tuple[str, str]]:
    for section in node.keys() & KIND_OF_SECTION.keys():
        definition = KIND_OF_SECTION[section].noun.replace(' ', '_')
        entities = node[section]
        for entity in entities.values() if isinstance(entities, dict) else ():
            yield from ((definition, key) for key in (entity if isinstance(entity, dict) else ()))


def _is_known(place: tuple[str, str]) -> bool:
    definition, key = place
    return key in known_keys(definition) or (not definition and key.startswith('x-'))


@cache
def known_keys(definition: str) -> frozenset[str]:
    """Return the keys that a definition of the schema knows; those of a file for `''`."""
    document = _schema(SCHEMA_NAME).schema
    schema = document['$defs'][definition] if definition else document
    branches = (schema, *schema.get('oneOf', ()))
    return frozenset(key for branch in branches for key in branch.get('properties', ()))


def _is_outer(path: DataPath, meant: str) -> bool:
    if len(path) == 1:
        return True
    is_condition = meant in ('foreach', 'when')
    if len(path) == _DEPTH_OF_ENTITIES:
        return path[0] == 'nodes' and path[2] in KIND_OF_SECTION and is_condition
    is_entry = len(path) == _DEPTH_OF_ENTRIES and path[0] in _OUTER_SECTIONS
    is_section = path[0] == 'nodes' and meant in KIND_OF_SECTION
    return is_entry and (path[0] == 'args' or is_condition or is_section)


def _correct_keys(
    data: dict[str, Any],
    positions: SourceMap,
    is_wanted: Callable[[DataPath, str], bool] = lambda *_: True,
    schema: str = SCHEMA_NAME,
) -> list[Diagnostic]:
    """Correct misspelt keys in place; return the findings for them."""
    findings: list[Diagnostic] = []
    while len(findings) < MAX_FINDINGS:
        names: dict[DataPath, dict[Key, str]] = {}
        for violation in _find_violations(data, schema):
            meant = violation.meant
            if meant is None or not is_wanted(violation.path, meant):
                continue
            parent, key = violation.path[:-1], violation.path[-1]
            renamed = names.setdefault(parent, {})
            if meant not in _value_at(data, parent) and meant not in renamed.values():
                renamed[key] = meant
                findings.append(violation.diagnostic(positions))
                positions.move(violation.path, (*parent, meant))
        if not any(names.values()):
            break
        for path, renamed in names.items():
            _rename_keys(_value_at(data, path), renamed)
    return findings


def _drop_invalid(data: dict[str, Any], violations: list[Violation]) -> Iterator[DataPath]:
    """Remove or replace what is not valid, in place; yield its paths."""
    while violations:
        entries = [violation.drop for violation in violations if not violation.stand_in]
        for violation in violations:
            if violation.stand_in:
                key, value = violation.stand_in
                _value_at(data, violation.path)[key] = value
                yield (*violation.path, key)
        yield from entries
        _remove_entries(data, entries)
        for key, value in _REQUIRED.items():
            data.setdefault(key, value)
        violations = _find_violations(data)


def is_sound(part: dict[str, Any]) -> bool:
    """Return whether some top-level keys alone are valid."""
    return not _find_violations(_REQUIRED | part)


def find_problem(part: dict[str, Any]) -> str | None:
    """Return what is wrong with some top-level keys alone; `None` if they are valid."""
    violations = _find_violations(_REQUIRED | part)
    return violations[0].message if violations else None


def lacks_keys(part: dict[str, Any]) -> bool:
    """Return whether keys are missing in some top-level keys alone, expressions or not."""
    return any(each.rule == 'missing-key' for each in _find_violations(_REQUIRED | part))


def without_templates(schema: Any) -> Any:
    """Return a schema without the alternatives for expressions.

    The only alternative left takes the place of its `anyOf`.
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


def _find_violations(data: dict[str, Any], schema: str = SCHEMA_NAME) -> list[Violation]:
    """Return the violations, a thousand at most."""
    validator = _schema(schema)
    if validator.is_surely_valid(data):
        return []
    errors = validator.iter_errors(data)
    violations = (violation for error in errors for violation in explain(error))
    return list(islice(violations, MAX_FINDINGS))


def _value_at(data: Any, path: Sequence[Key]) -> Any:
    for key in path:
        data = data[key]
    return data


def _rename_keys(mapping: dict[Key, Any], names: dict[Key, str]) -> None:
    entries = list(mapping.items())
    mapping.clear()
    mapping.update((names.get(key, key), value) for key, value in entries)


def _entry_of(path: DataPath) -> DataPath:
    """Return the path of the mapping entry of a value: items of lists cannot be dropped."""
    return tuple(takewhile(lambda key: isinstance(key, str), path))


def _remove_entries(data: Any, paths: Iterable[DataPath]) -> None:
    """Remove entries of nested mappings and lists, if they exist."""
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


@cache
def _schema(name: str) -> SchemaValidator:
    text = schema_path(name).read_text(encoding='utf-8')
    return SchemaValidator(without_templates(json.loads(text)))


class SchemaValidator:
    """The validator of one schema.

    The verdict is that of jsonschema. It accepts all that jsonschema-rs accepts, and some more:
    letters of all scripts in patterns, for one.

    Attributes:
        schema: The schema itself.
    """

    def __init__(self, schema: dict[str, Any]) -> None:
        self.schema = schema
        self._quick: dict[str, Validator] = {}
        try:
            import jsonschema_rs
        except ImportError:  # There are wheels for x86-64 and aarch64.
            self._quick_class = None
        else:
            self._quick_class = jsonschema_rs.Draft202012Validator

    def is_surely_valid(self, data: Any, reference: str = _ROOT) -> bool:
        """Return whether data are known to be valid, without an error to explain.

        Args:
            reference: A definition, as in `#/$defs/node`; the whole schema otherwise.
        """
        if self._quick_class is None:
            return False
        if reference not in self._quick:
            part = {'$ref': reference, '$defs': self.schema['$defs']}
            schema = self.schema if reference == _ROOT else part
            self._quick[reference] = self._quick_class(schema)
        try:
            return self._quick[reference].is_valid(data)
        except ValueError:  # YAML has more than JSON, as keys that are numbers.
            return False

    def iter_errors(self, data: Any) -> Iterator[ValidationError]:
        """Yield what is not valid."""
        errors: Iterator[ValidationError] = self._explaining.iter_errors(data)
        return errors

    @cached_property
    def _explaining(self) -> Any:
        # Importing it takes a fifth of a check's time, and most files are valid.
        from jsonschema import Draft202012Validator
        from jsonschema.exceptions import ValidationError
        from jsonschema.validators import extend

        check_fully = Draft202012Validator.VALIDATORS['$ref']

        def check_reference(
            validator: Any, reference: str, instance: object, part: object
        ) -> Iterable[ValidationError]:
            """Pass over valid parts of the data."""
            if self.is_surely_valid(instance, reference):
                return ()
            return check_fully(validator, reference, instance, part) or ()

        def check_maximum(
            validator: Any, maximum: float, instance: Any, _schema: object
        ) -> Iterator[ValidationError]:
            """As in JSON Schema, but a NaN is beyond every maximum: JSON has none, YAML has."""
            if validator.is_type(instance, 'number') and not instance <= maximum:
                text = f'{instance!r} is greater than the maximum of {maximum!r}'
                yield ValidationError(text)

        keywords = {'$ref': check_reference, 'maximum': check_maximum}
        return extend(Draft202012Validator, keywords)(self.schema)
