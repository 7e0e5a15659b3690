"""What a process was given: its command line as ROS reads it, its environment and its folder."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.interfaces.build.build_cache import find_cache
from composer.names import expand_namespace, join_names
from composer.ros_parameters.file_reader import parse_parameter_file
from composer.ros_parameters.node_patterns import matches_pattern
from composer.ros_parameters.rcl_values import parse_override

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_ROS_ARGS = '--ros-args'
# What runs the program has its own values of these.
_NOT_COMPARED = re.compile(
    r'PYTHONUNBUFFERED|PWD|OLDPWD|SHLVL|_|LC_CTYPE|PATH|NOTIFY_SOCKET|COMPOSER_\w+'
)

# Files that launch code writes at each start, and anonymous names.
_RANDOM = re.compile(r'(?<=/)(launch_params_|tmp)[a-z0-9_]{8}\b|(?<=_)\d+_\d{6,}\b')


@dataclass
class Given:
    """What a process, or a component, was given.

    Attributes:
        program: The name of its file, or the class of the component.
        arguments: Those that are not for ROS.
        remaps: Rules, from and to; of two rules for one name, the first.
        parameters: For its node, or by the patterns of nodes if its name is not given.
        others: Further arguments for ROS.
    """

    program: str
    arguments: list[str] = field(default_factory=list)
    name: str | None = None
    namespace: str = '/'
    remaps: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, Any] = field(default_factory=dict)
    others: list[str] = field(default_factory=list)
    environment: dict[str, str] = field(default_factory=dict)
    folder: str = ''

    @property
    def label(self) -> str:
        """How the process is called in a report."""
        name = f' {join_names(self.namespace, self.name)}' if self.name else ''
        return f'{Path(self.program).name}{name}'

    def lines(self) -> Iterator[str]:
        """Yield all that was given, one thing a line, in an order of its own."""
        yield f'program: {self.program}'
        yield f'arguments: {self.arguments}'
        yield f'name: {self.name}'
        yield f'namespace: {self.namespace}'
        yield from (f'remap: {old} -> {new}' for old, new in sorted(self.remaps.items()))
        yield from (
            f'parameter: {key} = {value!r}' for key, value in sorted(self.parameters.items())
        )
        yield from (f'ROS argument: {each}' for each in sorted(self.others))
        yield from (f'environment: {key}={each}' for key, each in sorted(self.environment.items()))
        yield f'folder: {self.folder}'


def read_given(written: Mapping[str, Any], replaced: Mapping[str, str]) -> Given:
    """Return what a stand-in has written down.

    Args:
        replaced: Texts in paths, and what they stand for.
    """
    if 'plugin' in written:
        return _read_component(json.loads(_replace(json.dumps(written), replaced)))
    argv = [_replace(each, replaced) for each in written['argv']]
    given = Given(argv[0].rpartition('/')[2])
    values: list[tuple[str, str, Any]] = []
    inside = False
    words = iter(zip(argv[1:], written['argv'][1:], strict=True))
    for word, original in words:
        if word == _ROS_ARGS:
            inside = True
        elif inside and word == '--':
            inside = False
        elif not inside:
            given.arguments.append(word)
        elif word in ('-r', '--remap'):
            _add_remap(given, next(words, ('', ''))[0])
        elif word in ('-p', '--param'):
            name, _, value = next(words, ('', ''))[0].partition(':=')
            read = parse_override(value)
            values.append(('/**', name, read[0] if read else value))
        elif word == '--params-file':
            _, path = next(words, ('', original))
            text = _replace(written['files'].get(path, ''), replaced)
            entries = parse_parameter_file(text, path).entries
            values += [(entry.pattern, entry.name, entry.value) for entry in entries]
        elif word.startswith('--log-level'):
            given.others.append(f'{word} {next(words, ("", ""))[0]}')
        else:
            given.others.append(word)
    # A rule for a name itself only keeps those after it from it.
    given.remaps = {old: new for old, new in given.remaps.items() if old != new}
    given.parameters = _merged(values, given)
    given.environment = {
        key: _replace(value, replaced)
        for key, value in _without_built(written['env'])
        if not _NOT_COMPARED.fullmatch(key)
    }
    given.folder = _replace(written['cwd'], replaced)
    return given


def _read_component(written: Mapping[str, Any]) -> Given:
    plugin = written['plugin']
    given = Given(plugin, [f'in /{written["container"].lstrip("/")}'])
    # Without a name it has one of its own, which nobody but the container knows.
    given.name = written['name'] or plugin.rpartition(':')[2]
    given.namespace = expand_namespace(written['namespace'])
    for rule in written['remaps']:
        _add_remap(given, rule)
    given.parameters = dict(_flat(written['parameters'], ''))
    given.others = [f'{key} = {value}' for key, value in written['extra'].items() if value]
    return given


def _without_built(environment: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the variables, without the interface packages that Composer has built in paths."""
    built = re.compile(rf'{re.escape(str(find_cache()))}/[^:]*:?')
    for name, value in environment.items():
        plain, count = built.subn('', value)
        if not count:
            yield name, value
        elif rest := plain.rstrip(':'):
            yield name, rest


def _add_remap(given: Given, rule: str) -> None:
    old, _, new = rule.partition(':=')
    if old in ('__node', '__name'):
        given.name = given.name or new
    elif old == '__ns':
        given.namespace = expand_namespace(new)
    elif old not in given.remaps:
        given.remaps[old] = new


def _merged(values: list[tuple[str, str, Any]], given: Given) -> dict[str, Any]:
    """Return the values of parameters, the last of each, in rcl's order of nodes."""
    by_node: dict[str, dict[str, Any]] = {}
    for pattern, name, value in values:
        by_node.setdefault(pattern, {})[name] = _plain(value)
    if given.name is None:
        return {
            f'{node}: {key}': value for node, own in by_node.items() for key, value in own.items()
        }
    full = join_names(given.namespace, given.name)
    merged: dict[str, Any] = {}
    for node, own in by_node.items():
        if matches_pattern(node, full):
            merged |= own
    return merged


def _plain(value: Any) -> Any:
    is_xml = isinstance(value, str) and value.lstrip().startswith('<')
    # Read as YAML, as launch does, its lines become one.
    return ' '.join(value.split()) if is_xml else value


def _flat(data: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(data, dict):
        yield prefix, _plain(data)
        return
    for key, value in data.items():
        yield from _flat(value, f'{prefix}.{key}'.strip('.'))


def _replace(text: str, replaced: Mapping[str, str]) -> str:
    for old, new in replaced.items():
        text = text.replace(old, new)
    return _RANDOM.sub('…', text)
