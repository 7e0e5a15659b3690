"""A snapshot as plain data and back, for `composer plan` to compare files with a running system.

It holds digests, no sources. Values of environment variables are left out, as in findings, and
so are those that are read when the system starts. Reading it back creates the records of
`composer.language.specs`, and nothing else.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.confidential import conceal, conceal_data
from composer.diagnostics import SourceFile, Span
from composer.errors import ComposerError
from composer.language import specs
from composer.planning.snapshot import Snapshot
from composer.ros_parameters.file_reader import ParameterEntry
from composer.yaml_text.positions import SourceMap

if TYPE_CHECKING:
    from composer.yaml_text.positions import DataPath

_RECORDS: dict[str, Any] = {
    name: each
    for name, each in vars(specs).items()
    if isinstance(each, type) and is_dataclass(each)
}
# Relative to the folder that Composer was started in, which may be another one.
_PATHS = frozenset(('cwd', 'file', 'interfaces'))
_VARIABLES = frozenset(('environment', 'env'))
# By so much of its digest a value is known to be another one, and a secret is not found.
_DIGITS = 4


def encode_snapshot(snapshot: Snapshot) -> dict[str, Any]:
    """Return a snapshot as data that JSON can hold."""
    files: dict[SourceFile, int] = {}

    def place(span: Span) -> list[int]:
        return [files.setdefault(span.source, len(files)), span.line, span.column, span.length]

    def places(spans: Mapping[DataPath, Span]) -> list[Any]:
        return [[list(path), place(span)] for path, span in spans.items()]

    place(Span(snapshot.positions.source, 1, 1))
    data = {
        'spec': _encode(_without_secrets(snapshot, snapshot.spec)),
        'keys': places(snapshot.positions.keys),
        'values': places(snapshot.positions.values),
        'code': dict(snapshot.code),
        'prefixes': list(snapshot.prefixes),
        'generators': sorted(snapshot.generators),
        'set_live': {node: sorted(names) for node, names in (snapshot.set_live or {}).items()},
        'definitions': [
            [*at, hashlib.sha256(text.encode(errors='surrogatepass')).hexdigest()]
            for at, text in snapshot.definitions.items()
        ],
        'overrides': [
            [node, name, _encode(entry.value), place(entry.value_span)]
            for node, entries in snapshot.overrides.items()
            for name, entry in entries.items()
        ],
    }
    names = [os.path.realpath(each.name) if each.home is None else each.name for each in files]
    homes = [each.home for each in files]
    return {**data, 'files': list(zip(names, homes, strict=True))}


def decode_snapshot(data: Mapping[str, Any]) -> Snapshot:
    """Return a snapshot of data; it can be compared, and has no sources.

    Raises:
        ComposerError: It is none that this version of Composer knows.
    """
    try:
        return _decode_snapshot(data)
    except (AttributeError, IndexError, KeyError, RecursionError, TypeError, ValueError) as error:
        message = f'a system was described in a form that is not known here: {error!r}'
        raise ComposerError(message, help='use the version that the system runs with') from error


def _decode_snapshot(data: Mapping[str, Any]) -> Snapshot:
    sources = [SourceFile(_relative(name), (), home) for name, home in data['files']]

    def span(place: list[int]) -> Span:
        file, line, column, length = place
        return Span(sources[file], line, column, length)

    def spans(places: list[Any]) -> dict[DataPath, Span]:
        return {tuple(path): span(place) for path, place in places}

    overrides: dict[str, dict[str, ParameterEntry]] = {}
    for node, name, value, place in data['overrides']:
        at = span(place)
        entry = ParameterEntry('', (name,), 0, _decode(value), None, at, at, at)
        overrides.setdefault(node, {})[name] = entry
    spec = _decode(data['spec'])
    if not isinstance(spec, specs.SystemSpec):
        message = 'that is no system'
        raise TypeError(message)
    return Snapshot(
        spec,
        SourceMap(sources[0], spans(data['keys']), spans(data['values'])),
        dict(data['code']),
        {},
        {(package, name): digest for package, name, digest in data['definitions']},
        overrides,
        tuple(data['prefixes']),
        frozenset(data['generators']),
        dict(data['set_live']),
    )


def conceal_snapshot(snapshot: Snapshot) -> Snapshot:
    """Return what others may see of a snapshot; it can be compared with another such one."""
    return decode_snapshot(encode_snapshot(snapshot))


def _without_secrets(snapshot: Snapshot, value: Any) -> Any:
    """Return a record with digests in place of what is left out, also in the records in it."""
    if isinstance(value, Mapping):
        inner = {k: _without_secrets(snapshot, v) for k, v in value.items()}
        return inner if isinstance(value, dict) else MappingProxyType(inner)
    if isinstance(value, tuple):
        return tuple(_without_secrets(snapshot, each) for each in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    changed = {
        each.name: _without_secrets(snapshot, getattr(value, each.name)) for each in fields(value)
    }
    path: DataPath = changed.get('path', ())
    for name in _VARIABLES & changed.keys():
        changed[name] = MappingProxyType({k: _digest(v) for k, v in changed[name].items()})
    if isinstance(value, specs.ParameterSpec):
        if snapshot.is_read_at_start(path) or snapshot.is_read_at_start((*path, 'default')):
            changed['value'] = _digest(value.value)
    elif isinstance(value, specs.ProcessSpec | specs.ComponentSpec):
        changed['parameters'] = MappingProxyType(
            {
                k: _digest(v) if snapshot.is_read_at_start((*path, 'parameters', k)) else v
                for k, v in changed['parameters'].items()
            }
        )
    return replace(value, **changed)


def _digest(value: Any) -> str:
    text = repr(value).encode(errors='surrogatepass')
    return f'<left out: {hashlib.sha256(text).hexdigest()[:_DIGITS]}>'


def _encode(value: Any, key: str = '') -> Any:
    """Return a value; what is no scalar becomes a list that begins with its kind."""
    if isinstance(value, str):
        return _absolute(value) if key in _PATHS else conceal(value)
    if value is None or isinstance(value, bool | int | float):
        return conceal_data(value)
    if is_dataclass(value):
        names = [each.name for each in fields(value)]
        return [
            type(value).__name__,
            {name: _encode_field(name, getattr(value, name)) for name in names},
        ]
    if isinstance(value, dict | MappingProxyType):
        kind = 'map' if isinstance(value, MappingProxyType) else 'dict'
        return [kind, [[each, _encode(inner, key)] for each, inner in value.items()]]
    if isinstance(value, list | tuple):
        return [type(value).__name__, [_encode(each, key) for each in value]]
    return str(value)


def _encode_field(name: str, value: Any) -> Any:
    return ['tuple', list(value)] if name == 'path' else _encode(value, name)


def _decode(value: Any) -> Any:
    if not isinstance(value, list):
        return value
    kind, inner = value
    if kind in ('dict', 'map'):
        items = {key: _decode(each) for key, each in inner}
        return MappingProxyType(items) if kind == 'map' else items
    if kind in ('list', 'tuple'):
        sequence = [_decode(each) for each in inner]
        return sequence if kind == 'list' else tuple(sequence)
    return _RECORDS[kind](**{name: _decode(each) for name, each in inner.items()})


def _absolute(path: str) -> str:
    return path if path.startswith('package://') else os.path.abspath(path)  # noqa: PTH100


def _relative(path: str) -> str:
    """Return a path as it is written here: relative, if it lies in this folder."""
    folder = f'{os.path.realpath(os.curdir)}/'
    return path.removeprefix(folder)
