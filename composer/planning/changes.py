"""Two records of one thing → the values that differ, each with its places in the files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import ENTITY_KINDS
from composer.language.qos import resolve_qos
from composer.language.specs import (
    BehaviourSpec,
    ConditionSpec,
    ExitActionSpec,
    ParameterFileSpec,
    ParameterReference,
    QosSpec,
)
from composer.names import expand_name
from composer.planning.plan import Change
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.diagnostics import Span
    from composer.language.specs import NodeSpec
    from composer.planning.snapshot import Snapshot
    from composer.yaml_text.positions import DataPath

_SCALARS = frozenset((str, int, bool, type(None)))
# Fields that the file has under other keys; where there are several, it has one of them.
_KEYS = {
    'period_sec': ('period', 'rate'),
    'warn_after_sec': ('warn_after',),
    'shutdown_timeout_sec': ('executor.shutdown_timeout',),
    'threads': ('executor.threads',),
    'diagnostics_period_sec': ('diagnostics',),
    'value': ('default',),
    'node_name': ('name',),
    'restart_delay_sec': ('restart.delay',),
    'most_restarts': ('restart.max',),
    'stop_signal': ('stop.signal',),
    'delay_sec': ('delay',),
    'stop_timeout_sec': ('stop.timeout',),
}
# What no value of these fields stands for.
_NONE = {'warn_after_sec': 'never', 'diagnostics_period_sec': False}
# Entities that do not set these have those of their node.
_INHERITED = ('on_error', 'warn_after_sec', 'local_delivery')
_CHANNELS = {kind.channel for kind in ENTITY_KINDS if kind.channel}


@record
class Reading:
    """A record, and the snapshot and the node that it is part of."""

    snapshot: Snapshot
    record: Any
    path: DataPath
    node: NodeSpec | None = None

    def keys_of(self, name: str) -> tuple[str, ...]:
        """Return the keys of the file that a field may be under."""
        # Those of a worker are its own, those of the system are under `executor`.
        is_own = name == 'threads' and self.path
        return (name,) if is_own else _KEYS.get(name, (name,))

    def find_span(self, name: str) -> Span:
        """Return where the value of a field is written, or the nearest around it that is."""
        positions = self.snapshot.positions
        keys = self.keys_of(name)
        paths = [(*self.path, *key.split('.')) for key in keys]
        if name in _INHERITED:
            paths.append((*self.path[:-2], keys[0]))
        return positions.value(
            next((each for each in paths if each in positions.values), paths[0])
        )


def compare_fields(old: Reading, new: Reading, names: Iterable[str]) -> Iterator[Change]:
    """Yield what differs in these fields of two records."""
    for name in names:
        before, after = getattr(old.record, name), getattr(new.record, name)
        # Most fields are of these types and as before.
        if type(before) in _SCALARS and type(before) is type(after) and before == after:
            continue
        if isinstance(before, BehaviourSpec) or isinstance(after, BehaviourSpec):
            yield from _compare_behaviours(old, new, name)
        elif isinstance(before, QosSpec):
            profiles = old.snapshot.spec.qos, new.snapshot.spec.qos
            if before != after or profiles[0] != profiles[1]:
                resolved = map(resolve_qos, (before, after), profiles)
                yield from compare_entries(old, new, name, *resolved)
        elif isinstance(before, Mapping):
            compare = _compare_references if name == 'by_parameter' else compare_entries
            yield from compare(old, new, name, before, after)
        elif _differ(plain := _plain(before, name), plain_after := _plain(after, name)):
            if name in _CHANNELS and _expand(old, before) == _expand(new, after):
                continue
            yield _change(old, new, name, plain, plain_after)


def compare_entries(
    old: Reading, new: Reading, name: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> Iterator[Change]:
    """Yield what differs between two mappings under a key."""
    if not (before or after):
        return
    for key in dict.fromkeys([*before, *after]):
        if (key in before) != (key in after) or _differ(before[key], after[key]):
            yield _change(old, new, f'{name}.{key}', before.get(key), after.get(key))


def _compare_references(
    old: Reading, new: Reading, _: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> Iterator[Change]:
    """Yield what follows another parameter now, or in another way."""
    for key in dict.fromkeys([*before, *after]):
        was, now = _plain(before.get(key)), _plain(after.get(key))
        if was != now:
            yield _change(old, new, f'{key}.parameter', was, now)


def _compare_behaviours(old: Reading, new: Reading, name: str) -> Iterator[Change]:
    before: BehaviourSpec | None = getattr(old.record, name)
    after: BehaviourSpec | None = getattr(new.record, name)
    if before is None or after is None:
        yield _change(old, new, name, before and before.name, after and after.name)
        return
    if before.name != after.name:
        yield _change(old, new, name, before.name, after.name)
    elif old.snapshot.code_of(before) != new.snapshot.code_of(after):
        yield _change(old, new, name, before.name, after.name, is_code=True)
    key = 'with' if name == 'behaviour' else f'{name}.with'
    yield from compare_entries(old, new, key, before.arguments, after.arguments)


def _change(
    old: Reading, new: Reading, name: str, before: Any, after: Any, *, is_code: bool = False
) -> Change:
    key = new.keys_of(name)[0]
    return Change(key, before, after, old.find_span(name), new.find_span(name), is_code)


def _expand(reading: Reading, name: str) -> str:
    node = reading.node
    return name if node is None else expand_name(name, node.name, node.namespace)


def _plain(value: Any, name: str = '') -> Any:
    """Return a value without the places in the file that records know."""
    if value is None:
        return _NONE.get(name)
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, ConditionSpec):
        state = f' {value.state}' if value.state else ''
        return f'{value.kind} {value.name}{state} within {value.timeout_sec:g} s'
    if isinstance(value, ExitActionSpec):
        return _plain_action(value)
    if isinstance(value, ParameterReference):
        return f'{value.parameter} {value.format} {value.scale:g}'.removesuffix(' {} 1')
    if isinstance(value, ParameterFileSpec):
        return _plain_file(value)
    return value


def _plain_file(file: ParameterFileSpec) -> Any:
    if not file.is_changed:
        return file.file
    values = None if file.expressions is None else json.loads(file.expressions)
    parts = {'file': file.file, 'root': file.root, 'expressions': values}
    return {key: value for key, value in parts.items() if value not in (None, '')}


def _plain_action(action: ExitActionSpec) -> Any:
    if action.behaviour is None:
        return 'shutdown' if action.start is None else {'start': action.start}
    arguments = dict(action.behaviour.arguments)
    return {'behaviour': action.behaviour.name} | ({'with': arguments} if arguments else {})


def _differ(old: Any, new: Any) -> bool:
    # `1` and `True` are equal in Python, and so are `1` and `1.0`: to ROS they are not.
    return repr(old) != repr(new)
