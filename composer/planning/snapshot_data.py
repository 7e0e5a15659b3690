"""A snapshot as plain data and back, for `composer plan` to compare files with a running system.

It holds digests, no sources. Values of environment variables, and those that are read when the
system starts, are left out, and so is what expressions make of them: digests with a key of the
user stand for them, so that only the user can see whether they differ. Reading it back creates
the records of `composer.language.specs`, and nothing else.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import re
import secrets
import tempfile
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.confidential import conceal, hide_again, origin_of
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
_LEFT_OUT = re.compile(r'<left out: \w+>')
_LEFT_OUT_BY_OTHERS = '<left out>'
# Of what is kept where others cannot ask for it, and is compared with what other users make.
KEY_OF_ALL = b'composer'
_DIGITS = 16
# With a key that all have, by so much a value is known to be another one, and is not found.
_DIGITS_FOR_ALL = 4

# Returns what stands for a value that is left out.
_Digest: TypeAlias = Callable[..., str]


@cache
def user_key() -> bytes:
    """Return the key of this user, which others cannot read; of this process, if none is kept."""
    key = secrets.token_bytes(32)
    state = os.environ.get('XDG_STATE_HOME') or '~/.local/state'
    with suppress(OSError, RuntimeError):
        path = Path(state).expanduser() / 'composer' / 'key'
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent) as file:
            file.write(key)
            file.flush()
            with suppress(FileExistsError):
                os.link(file.name, path)
        key = path.read_bytes()
    return key


def encode_snapshot(
    snapshot: Snapshot, key: bytes | None = None, known: str = ''
) -> dict[str, Any]:
    """Return a snapshot as data that JSON can hold.

    Args:
        key: That of the digests of what is left out; by default that of the user. If it is empty,
            they are all the same; with `KEY_OF_ALL`, only the origins of hidden values are told.
        known: A snapshot as text. The values that it leaves out are left out here, too.
    """
    hide_again(snapshot.hidden)
    key = user_key() if key is None else key
    digest = partial(_digest, key)
    encode = partial(_encode, digest, frozenset(_LEFT_OUT.findall(known)))
    files: dict[SourceFile, int] = {}

    def place(span: Span) -> list[int]:
        return [files.setdefault(span.source, len(files)), span.line, span.column, span.length]

    def places(spans: Mapping[DataPath, Span]) -> list[Any]:
        return [[list(path), place(span)] for path, span in spans.items()]

    place(Span(snapshot.positions.source, 1, 1))
    data = {
        'key': _name_key(key),
        'spec': encode('', _without_secrets(snapshot, digest, snapshot.spec)),
        'keys': places(snapshot.positions.keys),
        'values': places(snapshot.positions.values),
        'code': dict(snapshot.code),
        'classes': dict(snapshot.classes),
        'prefixes': list(snapshot.prefixes),
        'generators': sorted(snapshot.generators),
        'set_live': {node: sorted(names) for node, names in (snapshot.set_live or {}).items()},
        'definitions': [
            [*at, hashlib.sha256(text.encode(errors='surrogatepass')).hexdigest()]
            for at, text in snapshot.definitions.items()
        ],
        'overrides': [
            [node, name, encode('', entry.value), place(entry.value_span)]
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
        classes=dict(data['classes']),
    )


def conceal_snapshot(snapshot: Snapshot) -> Snapshot:
    """Return what others may see of a snapshot; it can be compared with another such one."""
    return decode_snapshot(encode_snapshot(snapshot))


def conceal_both(text: str, new: Snapshot) -> tuple[Snapshot, Snapshot]:
    """Return two snapshots that can be compared.

    Values that are left out count as the same if another user has left them out.

    Args:
        text: The old one, as JSON.
    """
    key = user_key()
    if json.loads(text).get('key') != _name_key(key):
        text, key = _LEFT_OUT.sub(_LEFT_OUT_BY_OTHERS, text), b''
    concealed = decode_snapshot(encode_snapshot(new, key, text))
    old = decode_snapshot(json.loads(text))
    # What the new one hides may stand in the old one.
    again = decode_snapshot(encode_snapshot(old, key))
    return replace(again, definitions=old.definitions), concealed


def _without_secrets(snapshot: Snapshot, digest: _Digest, value: Any) -> Any:
    """Return a record with digests in place of what is left out, also in the records in it."""
    if isinstance(value, Mapping):
        inner = {k: _without_secrets(snapshot, digest, v) for k, v in value.items()}
        return inner if isinstance(value, dict) else MappingProxyType(inner)
    if isinstance(value, tuple):
        return tuple(_without_secrets(snapshot, digest, each) for each in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    changed = {
        each.name: _without_secrets(snapshot, digest, getattr(value, each.name))
        for each in fields(value)
    }
    path: DataPath = changed.get('path', ())
    for name in _VARIABLES & changed.keys():
        changed[name] = MappingProxyType({k: digest(v) for k, v in changed[name].items()})
    if isinstance(value, specs.ParameterSpec):
        if snapshot.is_read_at_start(path) or snapshot.is_read_at_start((*path, 'default')):
            changed['value'] = digest(value.value)
    elif isinstance(value, specs.ProcessSpec | specs.ComponentSpec):
        changed['parameters'] = MappingProxyType(
            {
                k: digest(v) if snapshot.is_read_at_start((*path, 'parameters', k)) else v
                for k, v in changed['parameters'].items()
            }
        )
    return replace(value, **changed)


def _is_left_out(value: Any) -> bool:
    return isinstance(value, str) and value.startswith('<left out')


def _name_key(key: bytes) -> str:
    return hmac.digest(key, b'name', 'sha256').hex()


def _digest(key: bytes, value: Any, origin: str = '') -> str:
    if _is_left_out(value):
        return str(value)
    if not key:
        return _LEFT_OUT_BY_OTHERS
    if key == KEY_OF_ALL and origin:
        return f'<from {origin}>'
    text = repr(value).encode(errors='surrogatepass')
    digits = _DIGITS_FOR_ALL if key == KEY_OF_ALL else _DIGITS
    return f'<left out: {hmac.digest(key, text, "sha256").hex()[:digits]}>'


def _encode(digest: _Digest, known: Collection[str], key: str, value: Any) -> Any:
    """Return a value; what is no scalar becomes a list that begins with its kind."""
    encode = partial(_encode, digest, known)
    if value is None or isinstance(value, bool | int | float | str):
        if (origin := origin_of(value)) is not None:
            return digest(value, origin)
        if known and digest(value) in known:
            return digest(value)
        if not isinstance(value, str) or _is_left_out(value):
            return value
        return _absolute(value) if key in _PATHS else conceal(value)
    if is_dataclass(value):
        values = {each.name: getattr(value, each.name) for each in fields(value)}
        return [
            type(value).__name__,
            {
                name: ['tuple', list(each)] if name == 'path' else encode(name, each)
                for name, each in values.items()
            },
        ]
    if isinstance(value, dict | MappingProxyType):
        kind = 'map' if isinstance(value, MappingProxyType) else 'dict'
        return [kind, [[each, encode(key, inner)] for each, inner in value.items()]]
    if isinstance(value, list | tuple):
        return [type(value).__name__, [encode(key, each) for each in value]]
    return str(value)


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
