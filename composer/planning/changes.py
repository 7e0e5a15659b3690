"""Two records of one thing → the values that differ, each with its places in the files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.language.qos import resolve_qos
from composer.language.specs import BehaviourSpec, ConditionSpec, QosSpec
from composer.planning.plan import Change

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.diagnostics import Span
    from composer.planning.snapshot import Snapshot
    from composer.yaml_text.positions import DataPath

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
    'stop_timeout_sec': ('stop.timeout',),
}


@dataclass(frozen=True, slots=True)
class Reading:
    """A record, and the snapshot that it is part of."""

    snapshot: Snapshot
    record: Any
    path: DataPath

    def find_span(self, name: str) -> Span:
        """Return where the value of a field is written, or the nearest around it that is."""
        positions = self.snapshot.positions
        paths = [(*self.path, *key.split('.')) for key in _KEYS.get(name, (name,))]
        return positions.value(
            next((each for each in paths if each in positions.values), paths[0])
        )


def compare_fields(old: Reading, new: Reading, names: Iterable[str]) -> Iterator[Change]:
    """Yield what differs in these fields of two records."""
    for name in names:
        before, after = getattr(old.record, name), getattr(new.record, name)
        if isinstance(before, BehaviourSpec) or isinstance(after, BehaviourSpec):
            yield from _compare_behaviours(old, new, name)
        elif isinstance(before, QosSpec):
            resolved = (
                resolve_qos(before, old.snapshot.spec.qos),
                resolve_qos(after, new.snapshot.spec.qos),
            )
            yield from compare_entries(old, new, name, *resolved)
        elif isinstance(before, Mapping):
            yield from compare_entries(old, new, name, before, after)
        elif _differ(plain := _plain(before), plain_after := _plain(after)):
            yield _change(old, new, name, plain, plain_after)


def compare_entries(
    old: Reading, new: Reading, name: str, before: Mapping[str, Any], after: Mapping[str, Any]
) -> Iterator[Change]:
    """Yield what differs between two mappings under a key."""
    for key in dict.fromkeys([*before, *after]):
        if (key in before) != (key in after) or _differ(before[key], after[key]):
            yield _change(old, new, f'{name}.{key}', before.get(key), after.get(key))


def _compare_behaviours(old: Reading, new: Reading, name: str) -> Iterator[Change]:
    before: BehaviourSpec | None = getattr(old.record, name)
    after: BehaviourSpec | None = getattr(new.record, name)
    if before is None or after is None:
        yield _change(old, new, name, before and before.name, after and after.name)
        return
    if before.name != after.name:
        yield _change(old, new, name, before.name, after.name)
    elif old.snapshot.code.get(before.module) != new.snapshot.code.get(after.module):
        yield _change(old, new, name, before.name, after.name, is_code=True)
    yield from compare_entries(old, new, 'with', before.arguments, after.arguments)


def _change(
    old: Reading, new: Reading, name: str, before: Any, after: Any, *, is_code: bool = False
) -> Change:
    key = _KEYS.get(name, (name,))[0]
    return Change(key, before, after, old.find_span(name), new.find_span(name), is_code)


def _plain(value: Any) -> Any:
    """Return a value without the places in the file that records know."""
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    if isinstance(value, ConditionSpec):
        return f'{value.kind} {value.name} within {value.timeout_sec:g} s'
    return value


def _differ(old: Any, new: Any) -> bool:
    # `1` and `True` are equal in Python, and so are `1` and `1.0`: to ROS they are not.
    return repr(old) != repr(new)
