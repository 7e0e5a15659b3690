"""A JSON Schema → a function that quickly checks whether data are valid.

It agrees with the validator, but explains nothing, and takes a tenth of its time. The validator is
needed only for data that are not valid.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

Check: TypeAlias = Callable[[Any], bool]
Schema: TypeAlias = dict[str, Any]

_DEFINITIONS = '#/$defs/'
# Keywords without a meaning for the data.
_NOTES = frozenset(
    (
        *('$schema', '$id', '$defs', 'title', 'description', 'x-expected'),
        # Editors show text for an example that is a mapping only as a snippet.
        *('examples', 'defaultSnippets'),
    )
)


class SchemaCompiler:
    """Compiles the parts of one schema; each definition once."""

    def __init__(self, definitions: dict[str, Schema]) -> None:
        self._definitions = definitions
        self._compiled: dict[str, Check] = {}

    def compile_reference(self, reference: str) -> Check:
        """Return the check for `#/$defs/<name>`; definitions do not refer to themselves."""
        name = reference.removeprefix(_DEFINITIONS)
        if name not in self._compiled:
            self._compiled[name] = self.compile(self._definitions[name])
        return self._compiled[name]

    def compile(self, schema: Schema | Literal[False]) -> Check:
        """Return the check for a schema.

        Raises:
            ValueError: It has a keyword that the schema of the language does not use.
        """
        if isinstance(schema, bool):
            return lambda _: False
        compilers = dict.fromkeys(
            compiler for keyword, compiler in _COMPILERS.items() if keyword in schema
        )
        parts = [compiler(self, schema) for compiler in compilers]
        unknown = schema.keys() - _COMPILERS.keys() - _NOTES
        if unknown:
            message = f'the schema compiler does not know the keywords {sorted(unknown)}'
            raise ValueError(message)
        return _all_of(parts)


def _all_of(parts: list[Check]) -> Check:
    """Return the check for all parts; a chain of two each is faster than a loop."""
    if not parts:
        return lambda _: True
    first, *others = parts
    if not others:
        return first
    rest = _all_of(others)
    return lambda data: first(data) and rest(data)


def _compile_reference(compiler: SchemaCompiler, schema: Schema) -> Check:
    return compiler.compile_reference(schema['$ref'])


def _compile_type(_: SchemaCompiler, schema: Schema) -> Check:
    names = schema['type']
    if isinstance(names, str):
        return _TYPES[names]
    tests = [_TYPES[name] for name in names]
    if 'integer' in names:
        return lambda data: any(test(data) for test in tests)
    # No other depends on more than the class of the data.
    known: dict[type, bool] = {}

    def is_valid(data: Any) -> bool:
        if type(data) not in known:
            known[type(data)] = any(test(data) for test in tests)
        return known[type(data)]

    return is_valid


def _compile_required(_: SchemaCompiler, schema: Schema) -> Check:
    keys = schema['required']
    return lambda data: not isinstance(data, dict) or all(key in data for key in keys)


def _compile_entries(compiler: SchemaCompiler, schema: Schema) -> Check:
    """Return the check for `properties`, `patternProperties` and `additionalProperties`."""
    known = {key: compiler.compile(part) for key, part in schema.get('properties', {}).items()}
    patterns = [
        (re.compile(pattern), compiler.compile(part))
        for pattern, part in schema.get('patternProperties', {}).items()
    ]
    rest = schema.get('additionalProperties', True)
    other = compiler.compile(rest) if isinstance(rest, dict) else lambda _: bool(rest)

    def is_entry_valid(key: str, value: Any) -> bool:
        matching = [is_valid for pattern, is_valid in patterns if pattern.search(key)]
        if key in known:
            matching.append(known[key])
        return all(is_valid(value) for is_valid in matching or (other,))

    def is_valid(data: Any) -> bool:
        return not isinstance(data, dict) or all(itertools.starmap(is_entry_valid, data.items()))

    def is_plain_valid(data: Any) -> bool:
        if isinstance(data, dict):
            for key, value in data.items():
                if not known.get(key, other)(value):
                    return False
        return True

    return is_valid if patterns else is_plain_valid


def _compile_items(compiler: SchemaCompiler, schema: Schema) -> Check:
    item = compiler.compile(schema['items'])
    return lambda data: not isinstance(data, list) or all(map(item, data))


def _compile_any_of(compiler: SchemaCompiler, schema: Schema) -> Check:
    branches = [compiler.compile(branch) for branch in schema['anyOf']]
    return lambda data: any(branch(data) for branch in branches)


def _compile_one_of(compiler: SchemaCompiler, schema: Schema) -> Check:
    branches = [compiler.compile(branch) for branch in schema['oneOf']]
    return lambda data: sum(branch(data) for branch in branches) == 1


def _compile_not(compiler: SchemaCompiler, schema: Schema) -> Check:
    excluded = compiler.compile(schema['not'])
    return lambda data: not excluded(data)


def _compile_enum(_: SchemaCompiler, schema: Schema) -> Check:
    options = schema['enum']
    return lambda data: any(_is_same(data, option) for option in options)


def _compile_const(_: SchemaCompiler, schema: Schema) -> Check:
    return lambda data: _is_same(data, schema['const'])


def _compile_pattern(_: SchemaCompiler, schema: Schema) -> Check:
    search = re.compile(schema['pattern']).search
    return lambda data: not isinstance(data, str) or bool(search(data))


def _compile_minimum(_: SchemaCompiler, schema: Schema) -> Check:
    limit = schema['minimum']
    return lambda data: not _is_number(data) or not data < limit


def _compile_exclusive_minimum(_: SchemaCompiler, schema: Schema) -> Check:
    limit = schema['exclusiveMinimum']
    return lambda data: not _is_number(data) or not data <= limit


def _compile_maximum(_: SchemaCompiler, schema: Schema) -> Check:
    limit = schema['maximum']
    # NaN is beyond every maximum.
    return lambda data: not _is_number(data) or data <= limit


def _compile_min_items(_: SchemaCompiler, schema: Schema) -> Check:
    return lambda data: not isinstance(data, list) or len(data) >= schema['minItems']


def _compile_max_items(_: SchemaCompiler, schema: Schema) -> Check:
    return lambda data: not isinstance(data, list) or len(data) <= schema['maxItems']


def _compile_min_length(_: SchemaCompiler, schema: Schema) -> Check:
    return lambda data: not isinstance(data, str) or len(data) >= schema['minLength']


def _compile_min_properties(_: SchemaCompiler, schema: Schema) -> Check:
    return lambda data: not isinstance(data, dict) or len(data) >= schema['minProperties']


def _compile_property_names(compiler: SchemaCompiler, schema: Schema) -> Check:
    is_valid = compiler.compile(schema['propertyNames'])
    return lambda data: not isinstance(data, dict) or all(map(is_valid, data))


def _compile_dependent_required(_: SchemaCompiler, schema: Schema) -> Check:
    rules = schema['dependentRequired'].items()
    return lambda data: (
        not isinstance(data, dict)
        or all(key not in data or all(other in data for other in keys) for key, keys in rules)
    )


def _is_number(data: Any) -> bool:
    return isinstance(data, int | float) and not isinstance(data, bool)


def _is_integer(data: Any) -> bool:
    return _is_number(data) and (isinstance(data, int) or data.is_integer())


def _is_same(data: Any, option: str | float | bool) -> bool:  # noqa: FBT001 - a value of JSON
    return data == option and isinstance(data, bool) == isinstance(option, bool)


_TYPES: dict[str, Check] = {
    'object': lambda data: isinstance(data, dict),
    'array': lambda data: isinstance(data, list),
    'string': lambda data: isinstance(data, str),
    'boolean': lambda data: isinstance(data, bool),
    'null': lambda data: data is None,
    'number': _is_number,
    'integer': _is_integer,
}

_COMPILERS: dict[str, Callable[[SchemaCompiler, Schema], Check]] = {
    '$ref': _compile_reference,
    'type': _compile_type,
    'required': _compile_required,
    'additionalProperties': _compile_entries,
    'properties': _compile_entries,
    'patternProperties': _compile_entries,
    'items': _compile_items,
    'anyOf': _compile_any_of,
    'oneOf': _compile_one_of,
    'not': _compile_not,
    'enum': _compile_enum,
    'const': _compile_const,
    'pattern': _compile_pattern,
    'minimum': _compile_minimum,
    'exclusiveMinimum': _compile_exclusive_minimum,
    'maximum': _compile_maximum,
    'minItems': _compile_min_items,
    'maxItems': _compile_max_items,
    'minLength': _compile_min_length,
    'minProperties': _compile_min_properties,
    'propertyNames': _compile_property_names,
    'dependentRequired': _compile_dependent_required,
}
