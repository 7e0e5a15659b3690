"""A snapshot as plain data and back, for `composer plan` to compare files with a running system.

It holds digests, no sources; values of environment variables are left out, as in findings. Reading
it back creates the records of `composer.language.specs`, and nothing else.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import fields, is_dataclass
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
    from collections.abc import Mapping

    from composer.yaml_text.positions import DataPath

_RECORDS: dict[str, Any] = {
    name: each
    for name, each in vars(specs).items()
    if isinstance(each, type) and is_dataclass(each)
}
# Relative to the folder that Composer was started in, which may be another one.
_PATHS = frozenset(('cwd', 'file', 'interfaces'))


def encode_snapshot(snapshot: Snapshot) -> dict[str, Any]:
    """Return a snapshot as data that JSON can hold."""
    files: dict[SourceFile, int] = {}

    def place(span: Span) -> list[int]:
        return [files.setdefault(span.source, len(files)), span.line, span.column, span.length]

    def places(spans: Mapping[DataPath, Span]) -> list[Any]:
        return [[list(path), place(span)] for path, span in spans.items()]

    place(Span(snapshot.positions.source, 1, 1))
    data = {
        'spec': _encode(snapshot.spec),
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
