"""Violations of the schema as data, and their wording."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.entity_kinds import ENTITY_KINDS
from composer.records import record
from composer.yaml_text.scalars import suggest_bool, suggest_flat

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jsonschema.exceptions import ValidationError

    from composer.diagnostics import Span
    from composer.yaml_text.positions import DataPath, SourceMap

_TYPE_WORDS = {
    'object': 'a mapping',
    'array': 'a list',
    'string': 'a string',
    'number': 'a number',
    'integer': 'an integer',
    'boolean': 'true or false',
    'null': 'null',
}
_LONGEST_SHOWN = 40
_QUANTITY = re.compile(r'(?P<number>[-+]?\d+(\.\d*)?)\s*(?P<unit>[A-Za-z]*)')
_UNITS = {'': 1, 'us': 1e-6, 'ms': 1e-3, 's': 1, 'sec': 1, 'min': 60, 'h': 3600, 'hz': 1}

# The values for missing keys of an entry. Checks skip them: their paths count as dropped.
_STAND_INS: dict[str, Mapping[str, Any]] = {
    **{kind.noun: kind.stand_in for kind in ENTITY_KINDS},
    'condition': {'topic': 'unknown'},
}


@record
class Violation:
    """One violation of the schema.

    Attributes:
        path: Where it is; for a key, the path of its value.
        at_key: Whether the key is wrong, rather than its value.
        drop: The path of the smallest mapping entry to drop before reading on.
        meant: For an unknown key, the nearest known one.
        conflicting: For keys that exclude each other, their paths; each may be the wrong one.
        stand_in: For a missing key, the key and a value to read the rest of its mapping with.
    """

    rule: str
    message: str
    path: DataPath
    drop: DataPath
    at_key: bool = False
    help: str | None = None
    meant: str | None = None
    stand_in: tuple[str, Any] | None = None
    conflicting: tuple[DataPath, ...] = ()

    def diagnostic(self, positions: SourceMap) -> Diagnostic:
        """Return the finding for it."""
        if self.conflicting:
            return self._conflict(positions)
        span = positions.key(self.path) if self.at_key else positions.value(self.path)
        return diagnostic_at(span, self.rule, self._quoting(span), help=self.help)

    def _quoting(self, span: Span) -> str:
        """Return the message with a number as it stands in the file: 1.50, not 1.5."""
        head, got, shown = self.message.rpartition(', got ')
        with suppress(ValueError):
            if got and float(shown) == float(span.text.replace('_', '')):
                return f'{head}{got}{span.text}'
        return self.message

    def _conflict(self, positions: SourceMap) -> Diagnostic:
        """Return the finding at the last key that is not merged into the mapping."""
        mapping = positions.value(self.path[:-1])
        spans = [positions.key(each) for each in self.conflicting]
        merged = [each for each in spans if _is_before(each, mapping)]
        own = [each for each in spans if each not in merged]
        related = [Related('merged in from here', each) for each in merged]
        at = own[-1] if own else mapping
        return diagnostic_at(at, self.rule, self.message, help=self.help, related=related)


def _is_before(span: Span, other: Span) -> bool:
    """Return whether a place is above another of its file, as an anchor is above its alias."""
    is_above = (span.line, span.column) < (other.line, other.column)
    return span.source is other.source and is_above


def path_of(error: ValidationError) -> DataPath:
    """Return the path of the data that an error is about."""
    return tuple(error.absolute_path)


def droppable(path: DataPath) -> DataPath:
    """Return the path of the innermost mapping entry: items of lists cannot be dropped alone."""
    while path and isinstance(path[-1], int):
        path = path[:-1]
    return path


_HELP_FOR_LAYERS = (
    "write 'version: 1' at the top; a layer is given after its system, as in 'composer check "
    "SYSTEM.yaml LAYER.yaml', or named under 'check:' of the system"
)


def missing_key(error: ValidationError, key: str, message: str) -> Violation:
    """Return the violation for a missing key."""
    path = path_of(error)
    title = error.schema.get('title', '')
    known = _STAND_INS.get(title, {})
    stand_in = (key, known[key]) if key in known else None
    return Violation(
        'missing-key',
        message,
        path,
        droppable(path),
        at_key=True,
        help=_HELP_FOR_LAYERS if (title, key) == ('Composer system', 'version') else None,
        stand_in=stand_in,
    )


def conflicting_keys(error: ValidationError, keys: list[str]) -> Violation:
    """Return the violation for keys that cannot be used together."""
    path = path_of(error)
    written = sorted(keys, key=list(error.instance).index)
    last = written[-1]
    listed = ' and '.join(f"'{key}'" for key in keys)
    return Violation(
        'conflicting-keys',
        f'{listed} cannot be used together{owner_of(error)}',
        (*path, last),
        (*path, last),
        at_key=True,
        help='keep one of them',
        conflicting=tuple((*path, key) for key in written),
    )


def wrong_type(error: ValidationError, expected: str) -> Violation:
    """Return the violation for a value of a wrong type."""
    path = path_of(error)
    empty = error.instance is None and expected == 'a mapping'
    help_text = 'write {} for an empty mapping, or remove the key' if empty else None
    is_bool = _TYPE_WORDS['boolean'] in expected
    help_text = help_text or _suggest_number(error, expected) or _suggest_place(error)
    return Violation(
        'wrong-type',
        f'expected {expected}, got {show_value(error.instance)}',
        path,
        droppable(path),
        help=help_text or (suggest_bool(error.instance) if is_bool else None) or _full_form(error),
    )


def _suggest_number(error: ValidationError, expected: str) -> str | None:
    """Return the help for a number in quotes, or with a unit: times are in s, rates in Hz."""
    found = _QUANTITY.fullmatch(str(error.instance))
    factor = _UNITS.get(found['unit'].lower()) if found else None
    if found is None or factor is None or 'number' not in expected:
        return None
    is_wrong = (path_of(error)[-1:] == ('rate',)) != found['unit'].lower().endswith('z')
    return None if found['unit'] and is_wrong else f'write {float(found["number"]) * factor:g}'


def _suggest_place(error: ValidationError) -> str | None:
    """Return the help for a list or mapping where the language, or ROS, has none."""
    path = path_of(error)
    if 'parameters' in path and isinstance(path[-1], int):
        return suggest_flat(error.instance)
    if path[:1] != ('args',) or path == ('args',) or not isinstance(error.instance, list | dict):
        return None
    return f"write it under 'vars:', or split a text: {{{{ {path[1]}.split(',') }}}}"


def _full_form(error: ValidationError) -> str | None:
    """Return how a lone value is written that one key of a mapping takes, if one does."""
    for key, schema in error.schema.get('properties', {}).items():
        if error.instance in schema.get('enum', ()):
            return f'write {{{key}: {error.instance}}}'
    return None


def describe_types(types: str | list[str]) -> str:
    """Return the types of JSON Schema in words."""
    names = [types] if isinstance(types, str) else types
    return ' or '.join(_TYPE_WORDS[name] for name in names)


def owner_of(error: ValidationError) -> str:
    """Return the end of a message, which names the entry; empty for the whole file."""
    title = error.schema.get('title')
    path = path_of(error)
    if not title or not path:
        return ''
    is_named = isinstance(path[-1], str) and path[-1] != title
    name = f" '{path[-1]}'" if is_named else ''
    return f' in {title}{name}'


def show_value(value: Any) -> str:
    """Return a value as a finding shows it: scalars as written, collections by their kind."""
    if value is None:
        return 'nothing'
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, dict):
        return 'a mapping' if value else 'an empty mapping'
    if isinstance(value, list):
        return 'a list' if value else 'an empty list'
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 1] + '…'
