"""Values that are known when the system starts: what a command prints, or a file holds.

They stand in place of a default: of parameters and arguments, of environment variables, and of
what a process is given. Until then a sample of their type stands for them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.confidential import hide
from composer.errors import StartError
from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.yaml_text.positions import DataPath, SourceMap

# Where the value is from, and what goes with that.
SOURCES = ('command', 'file')
SOURCE_KEYS = (*SOURCES, 'timeout', 'key')
DEFAULT_TIMEOUT_SEC = 30.0
_SAMPLES: dict[str, Any] = {
    'bool': True,
    'integer': 1,
    'double': 1.0,
    'string': 'sample',
    'byte': 1,
}


@record
class StartValue:
    """A value that is read when the system starts.

    Attributes:
        name: What it is the value of, in words.
        command: The program and its arguments; empty if it is read from a file.
        timeout_sec: What the command gets to end.
        file: A path, or `package://name/path`; empty if it is what a command prints.
        key: Where the value is in a YAML file, with dots; `None` for the text of the file.
        type: The type of a parameter; `None` for a text, or as it is in the file.
        is_exact: Whether line breaks at the end of a text belong to it.
        span: Where it is written.
        spans: Where the words of the command, or the file and the key, are written.
        host: The host whose part needs it; empty for all.
    """

    name: str
    command: tuple[str, ...]
    timeout_sec: float
    file: str
    key: str | None
    type: str | None
    is_exact: bool
    span: Span
    spans: tuple[Span, ...]
    host: str = ''

    def is_elsewhere(self, host: str) -> bool:
        """Return whether the part of a host does without it; `''` is the whole system."""
        return bool(host and self.host and self.host != host)

    @property
    def sample(self) -> Any:
        """A value that stands for the real one."""
        type_name = self.type or 'string'
        item = _SAMPLES[type_name.removesuffix('_array')]
        return [item] if type_name.endswith('_array') else item

    @property
    def origin(self) -> str:
        """Where it is written, in words."""
        return f'the {"command" if self.command else "file"} of {self.span.place}'

    @property
    def named_files(self) -> list[Path]:
        """The files that it names: a change of one may change the value."""
        if self.command:
            return [Path(word) for word in self.command if _is_file(word)]
        return [] if self.file.startswith('package://') else [Path(self.file)]


def _is_file(word: str) -> bool:
    try:
        return os.path.isfile(word)
    except (OSError, ValueError):
        return False  # too long, or no path at all


ReadValue: TypeAlias = Callable[[StartValue], Any]


@dataclass(slots=True)
class StartValues:
    """The values of a system that are read when it starts.

    Attributes:
        read: Reads one; `None` if the system does not start.
        found: All that are part of the system.
    """

    read: ReadValue | None = None
    found: list[StartValue] = field(default_factory=list)

    def value_of(self, value: StartValue) -> tuple[Any, bool]:
        """Return a value, or its sample, and whether it is a sample."""
        self.found.append(value)
        if self.read is None:
            return value.sample, True
        read = self.read(value)
        # What a command prints is for whoever starts the system: no check runs it.
        if not value.command:
            hide(read, value.origin)
        return read, False


def parse_start_value(
    name: str, data: Mapping[str, Any], path: DataPath, positions: SourceMap
) -> StartValue:
    """Return the value that a mapping with `command` or `file` describes."""
    command = tuple(map(_as_word, data.get('command', ())))
    at = [(*path, 'command', index) for index in range(len(command))] or [
        (*path, key) for key in ('file', 'key') if key in data
    ]
    return StartValue(
        name=name,
        command=command,
        timeout_sec=float(data.get('timeout', DEFAULT_TIMEOUT_SEC)),
        file=data.get('file', ''),
        key=data.get('key'),
        type=data.get('type', None if _is_untyped(path) else 'string'),
        is_exact='parameters' in path[2:3],
        span=positions.value(path),
        spans=tuple(map(positions.value, at)),
    )


def _as_word(word: Any) -> str:
    return str(word).lower() if isinstance(word, bool) else str(word)


def _is_untyped(path: DataPath) -> bool:
    return path[0] in ('processes', 'environment')


def is_start_value(data: Any) -> bool:
    """Return whether a value is a mapping that says where the value is from."""
    if not isinstance(data, dict):
        return False
    is_command = isinstance(data.get('command'), list) and data.keys() <= _KEYS_OF['command']
    is_file = isinstance(data.get('file'), str) and data.keys() <= _KEYS_OF['file']
    return is_command or is_file


_KEYS_OF = {'command': {'command', 'timeout', 'type'}, 'file': {'file', 'key', 'type'}}


def replace_start_values(
    data: dict[str, Any], replace: Callable[[DataPath, dict[str, Any]], Any]
) -> dict[str, Any]:
    """Return a system's data with other values in place of those that are read at the start.

    Args:
        replace: Returns the value for a path, and what stands there.
    """
    changed: dict[str, Any] = {}
    if 'environment' in data:
        changed['environment'] = _replaced(data['environment'], ('environment',), replace)
    for section in ('nodes', 'processes'):
        entries = data.get(section, {})
        new = {name: _in_entry(each, (section, name), replace) for name, each in entries.items()}
        if any(new[name] is not entries[name] for name in entries):
            changed[section] = new
    return data | changed if changed else data


def _in_entry(
    entry: dict[str, Any], path: DataPath, replace: Callable[[DataPath, dict[str, Any]], Any]
) -> dict[str, Any]:
    is_process = path[0] == 'processes'
    changed = {}
    for key in ('parameters', 'env') if is_process else ('parameters',):
        values = entry.get(key, {})
        at = (*path, key)
        new = (
            _replaced(values, at, replace)
            if is_process
            else {
                name: replace((*at, name), each)
                if isinstance(each, dict) and not each.keys().isdisjoint(SOURCES)
                else each
                for name, each in values.items()
            }
        )
        if any(new[name] is not values[name] for name in values):
            changed[key] = new
    if 'components' in entry:
        at, components = (*path, 'components'), entry['components']
        new = {name: _in_entry(each, (*at, name), replace) for name, each in components.items()}
        if any(new[name] is not components[name] for name in components):
            changed['components'] = new
    return entry | changed if changed else entry


def _replaced(
    values: dict[str, Any], path: DataPath, replace: Callable[[DataPath, dict[str, Any]], Any]
) -> dict[str, Any]:
    new = {}
    for name, value in values.items():
        at = (*path, name)
        if is_start_value(value):
            new[name] = replace(at, value)
        else:
            new[name] = _replaced(value, at, replace) if isinstance(value, dict) else value
    return new if any(new[name] is not values[name] for name in values) else values


def fill_start_values(
    data: dict[str, Any],
    positions: SourceMap,
    start: StartValues,
    sampled: list[Span],
    find_host: Callable[[DataPath], str],
) -> dict[str, Any]:
    """Return a system's data with the values that are read at the start, or samples of them.

    Args:
        sampled: Where samples are written is added to it.
        find_host: Returns the host of what a path leads to; empty for none.

    Raises:
        ComposerError: A value cannot be read.
    """

    def value_of(path: DataPath, written: dict[str, Any]) -> Any:
        source = parse_start_value(_describe(path), written, path, positions)
        source = replace(source, host=find_host(path))
        value, is_sample = start.value_of(source)
        if is_sample:
            sampled.append(source.span)
        if path[0] == 'nodes':
            rest = {key: each for key, each in written.items() if key not in SOURCE_KEYS}
            value = _allowed_sample(rest, value) if is_sample else value
            return {'type': source.type, **rest, 'default': value}
        if 'parameters' not in path[2:5:2] and isinstance(value, list | dict):
            message = f'{source.span}: {source.name}: expected a text, got {value!r}'
            raise StartError(message)
        return value

    return replace_start_values(data, value_of)


def _describe(path: DataPath) -> str:
    noun = 'parameter' if 'parameters' in path[2:5:2] else 'variable'
    if path[2:3] == ('components',):
        return f"parameter '{'.'.join(map(str, path[5:]))}' of component '{path[3]}'"
    owner = f' of {_OWNERS[str(path[0])]} {path[1]!r}' if path[0] in _OWNERS else ''
    names = path[3:] if owner else path[1:]
    return f"{noun} '{'.'.join(map(str, names))}'{owner}"


_OWNERS = {'nodes': 'node', 'processes': 'process'}


def _allowed_sample(declared: Mapping[str, Any], sample: Any) -> Any:
    choices = declared.get('choices') or [sample]
    return declared.get('minimum', declared.get('maximum', choices[0]))


def list_named_files(values: Iterable[StartValue]) -> set[Path]:
    """Return the files that values name, as far as they exist."""
    return {path for value in values for path in value.named_files}
