"""An error of the JSON Schema validator → faults in the words of the language."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.forms import find_meant_form
from composer.names import did_you_mean, suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from jsonschema.exceptions import ValidationError

    from composer.language.positions import DataPath, SourceMap

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

# What an entry without one of these keys is read on with; the checks pass over them, since the
# paths of stand-ins count as dropped.
_STAND_INS: dict[str, dict[str, Any]] = {
    'publisher': {'type': 'unknown/msg/Unknown'},
    'subscription': {'type': 'unknown/msg/Unknown', 'behaviour': 'unknown:unknown'},
    'timer': {'period': 1.0, 'behaviour': 'unknown:unknown'},
    'service': {'type': 'unknown/srv/Unknown', 'behaviour': 'unknown:unknown'},
    'service client': {'type': 'unknown/srv/Unknown'},
    'action': {'type': 'unknown/action/Unknown', 'behaviour': 'unknown:unknown'},
    'action client': {'type': 'unknown/action/Unknown'},
    'condition': {'topic': 'unknown'},
}


@dataclass(frozen=True, slots=True)
class StructureFault:
    """One fault of structure.

    Attributes:
        path: The data that are wrong; of a key, the path of its value.
        at_key: Whether the key is wrong and not the value.
        drop: The smallest mapping entry without which the data can be read on.
        meant: Of an unknown key, the one that it is nearest to.
        stand_in: Of a missing key, the key and a value to read the rest of its mapping with.
    """

    rule: str
    message: str
    path: DataPath
    drop: DataPath
    at_key: bool = False
    help: str | None = None
    meant: str | None = None
    stand_in: tuple[str, Any] | None = None

    def diagnostic(self, positions: SourceMap) -> Diagnostic:
        """Return the finding for it."""
        span = positions.key(self.path) if self.at_key else positions.value(self.path)
        return diagnostic_at(span, self.rule, self.message, help=self.help)


def explain(error: ValidationError) -> Iterator[StructureFault]:
    """Yield the faults behind an error; several for several unknown keys of one mapping."""
    explanation = _EXPLANATIONS.get(str(error.validator), _explain_otherwise)
    return explanation(error)


def _explain_unknown_keys(error: ValidationError) -> Iterator[StructureFault]:
    schema = error.schema
    known = schema.get('properties', {})
    path = _path(error)
    for key in error.instance:
        if key in known or any(re.search(p, key) for p in schema.get('patternProperties', {})):
            continue
        yield StructureFault(
            'unknown-key',
            f"unknown key '{key}'{_owner(error)}",
            (*path, key),
            (*path, key),
            at_key=True,
            help=did_you_mean(key, known, 'the keys are'),
            meant=suggest(key, known),
        )


def _explain_missing_keys(error: ValidationError) -> Iterator[StructureFault]:
    missing = [key for key in error.validator_value if key not in error.instance]
    # The validator reports each missing key on its own; its message begins with the key.
    key = next((key for key in missing if error.message.startswith(repr(key))), missing[0])
    yield _missing(error, key, f"the key '{key}' is missing{_owner(error)}")


def _explain_type(error: ValidationError) -> Iterator[StructureFault]:
    yield _wrong_type(error, _describe_types(error.validator_value))


def _explain_enum(error: ValidationError) -> Iterator[StructureFault]:
    options = [str(option) for option in error.validator_value]
    yield StructureFault(
        'bad-value',
        f'expected one of {", ".join(options)}; got {_shown(error.instance)}',
        _path(error),
        _droppable(_path(error)),
        help=_near(error.instance, options),
    )


def _explain_const(error: ValidationError) -> Iterator[StructureFault]:
    path = _path(error)
    if path == ('version',):
        yield StructureFault(
            'unsupported-version',
            f'version {_shown(error.instance)} is not known; this Composer reads version 1',
            path,
            path,
        )
        return
    yield StructureFault(
        'bad-value',
        f'expected {error.validator_value!r}, got {_shown(error.instance)}',
        path,
        _droppable(path),
    )


def _explain_pattern(error: ValidationError) -> Iterator[StructureFault]:
    expected = error.schema.get('x-expected', f'text that matches {error.validator_value}')
    path = _path(error)
    meant = find_meant_form(error.instance, error.validator_value)
    yield StructureFault(
        'bad-value',
        f'expected {expected}; got {_shown(error.instance)}',
        path,
        _droppable(path),
        help=f"did you mean '{meant}'?" if meant else None,
    )


_BOUNDS = {
    'minimum': 'at least',
    'maximum': 'at most',
    'exclusiveMinimum': 'more than',
    'minItems': 'at least',
    'minLength': 'at least',
}
_BOUND_UNITS = {'minItems': ' item', 'minLength': ' character'}


def _explain_bound(error: ValidationError) -> Iterator[StructureFault]:
    keyword = str(error.validator)
    path = _path(error)
    limit = f'{error.validator_value:.9f}'.rstrip('0').rstrip('.')
    yield StructureFault(
        'out-of-range',
        f'expected {_BOUNDS[keyword]} {limit}{_BOUND_UNITS.get(keyword, "")}, '
        f'got {_shown(error.instance)}',
        path,
        _droppable(path),
    )


def _explain_dependency(error: ValidationError) -> Iterator[StructureFault]:
    path = _path(error)
    for key, needed in error.validator_value.items():
        for other in needed:
            if key in error.instance and other not in error.instance:
                yield StructureFault(
                    'missing-key',
                    f"'{key}' needs '{other}' beside it",
                    (*path, key),
                    (*path, key),
                    at_key=True,
                )


def _explain_exclusion(error: ValidationError) -> Iterator[StructureFault]:
    if isinstance(error.instance, dict):
        yield _conflict(error, error.validator_value['required'])


def _explain_alternatives(error: ValidationError) -> Iterator[StructureFault]:
    branches = error.validator_value
    if all(set(branch) == {'required'} for branch in branches):
        if not isinstance(error.instance, dict):
            return  # what is no mapping has its finding for that
        yield _explain_key_alternatives(error, [branch['required'] for branch in branches])
        return
    by_branch: dict[int, list[ValidationError]] = {}
    for inner in error.context or ():
        by_branch.setdefault(int(inner.schema_path[0]), []).append(inner)
    expected = []
    for inner_errors in by_branch.values():
        mismatch = next((e for e in inner_errors if _is_mismatch(e, error)), None)
        if mismatch is None:
            for inner in inner_errors:
                yield from explain(inner)
            return
        expected.append(_describe_mismatch(mismatch))
    yield _wrong_type(error, ' or '.join(dict.fromkeys(expected)))


def _is_mismatch(inner: ValidationError, outer: ValidationError) -> bool:
    """Return whether an alternative is out of the question for what stands there."""
    if inner.absolute_path != outer.absolute_path:
        return False
    if inner.validator == 'const':
        return True
    nested = inner.validator == 'oneOf' and all(
        _is_mismatch(e, outer) for e in inner.context or ()
    )
    return inner.validator == 'type' or nested


def _describe_mismatch(error: ValidationError) -> str:
    if error.validator == 'const':
        return repr(error.validator_value)
    if error.validator == 'oneOf':
        return ' or '.join(_describe_mismatch(inner) for inner in error.context or ())
    return _describe_types(error.validator_value)


def _explain_key_alternatives(
    error: ValidationError, alternatives: list[list[str]]
) -> StructureFault:
    present = [keys for keys in alternatives if all(key in error.instance for key in keys)]
    if len(present) > 1:
        return _conflict(error, [keys[0] for keys in present])
    absent = [[key for key in keys if key not in error.instance] for keys in alternatives]
    wanted = ' or '.join(' and '.join(f"'{key}'" for key in keys) for keys in absent)
    verb = 'is' if all(len(keys) == 1 for keys in absent) else 'are'
    first = alternatives[0][0]
    return _missing(error, first, f'{wanted} {verb} missing{_owner(error)}')


def _explain_otherwise(error: ValidationError) -> Iterator[StructureFault]:
    path = _path(error)
    yield StructureFault('bad-value', error.message, path, _droppable(path))


_EXPLANATIONS: dict[str, Callable[[ValidationError], Iterator[StructureFault]]] = {
    'additionalProperties': _explain_unknown_keys,
    'required': _explain_missing_keys,
    'type': _explain_type,
    'enum': _explain_enum,
    'const': _explain_const,
    'pattern': _explain_pattern,
    'dependentRequired': _explain_dependency,
    'not': _explain_exclusion,
    'oneOf': _explain_alternatives,
    'anyOf': _explain_alternatives,
    **dict.fromkeys(_BOUNDS, _explain_bound),
}


def _path(error: ValidationError) -> DataPath:
    return tuple(error.absolute_path)


def _droppable(path: DataPath) -> DataPath:
    """Return the path of the innermost mapping entry; items of lists cannot go alone."""
    while path and isinstance(path[-1], int):
        path = path[:-1]
    return path


def _missing(error: ValidationError, key: str, message: str) -> StructureFault:
    path = _path(error)
    known = _STAND_INS.get(error.schema.get('title', ''), {})
    stand_in = (key, known[key]) if key in known else None
    return StructureFault(
        'missing-key', message, path, _droppable(path), at_key=True, stand_in=stand_in
    )


def _conflict(error: ValidationError, keys: list[str]) -> StructureFault:
    path = _path(error)
    last = max(keys, key=list(error.instance).index)
    listed = ' and '.join(f"'{key}'" for key in keys)
    return StructureFault(
        'conflicting-keys',
        f'{listed} exclude each other{_owner(error)}',
        (*path, last),
        (*path, last),
        at_key=True,
        help='keep one of them',
    )


def _wrong_type(error: ValidationError, expected: str) -> StructureFault:
    path = _path(error)
    empty = error.instance is None and expected == 'a mapping'
    return StructureFault(
        'wrong-type',
        f'expected {expected}, got {_shown(error.instance)}',
        path,
        _droppable(path),
        help='write {} for an empty mapping, or remove the key' if empty else None,
    )


def _describe_types(types: str | list[str]) -> str:
    names = [types] if isinstance(types, str) else types
    return ' or '.join(_TYPE_WORDS[name] for name in names)


def _owner(error: ValidationError) -> str:
    title = error.schema.get('title')
    if not title or title == 'Composer system':
        return ''
    path = _path(error)
    name = f" '{path[-1]}'" if path and path[-1] != title else ''
    return f' in {title}{name}'


def _near(value: Any, options: list[str]) -> str | None:
    if not isinstance(value, str):
        return None
    found = did_you_mean(value, options)
    return found if found and found.startswith('did') else None


def _shown(value: Any) -> str:
    """Return a value as a finding shows it: scalars as written, collections by their kind."""
    if value is None:
        return 'nothing'
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, dict):
        return 'a mapping'
    if isinstance(value, list):
        return 'a list' if value else 'an empty list'
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else text[: _LONGEST_SHOWN - 1] + '…'
