"""`wait_for` as data that satisfy the schema → specs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.language.specs import DEFAULT_WAIT_SEC, ConditionSpec

if TYPE_CHECKING:
    from composer.language.specs import ConditionKind
    from composer.yaml_text.positions import DataPath

_CONDITION_KINDS: tuple[ConditionKind, ...] = ('topic', 'service', 'action', 'node', 'process')


def parse_conditions(data: dict[str, Any], path: DataPath) -> tuple[ConditionSpec, ...]:
    """Return what a node or process waits for."""
    written = data.get('wait_for', [])
    at = (*path, 'wait_for')
    if isinstance(written, dict):
        return (_parse_condition(written, at),)
    return tuple(_parse_condition(each, (*at, index)) for index, each in enumerate(written))


def _parse_condition(data: dict[str, Any], path: DataPath) -> ConditionSpec:
    kind = kind_of(data)
    timeout_sec = float(data.get('timeout', DEFAULT_WAIT_SEC))
    return ConditionSpec(kind, data[kind], timeout_sec, data.get('state'), (*path, kind))


def kind_of(condition: dict[str, Any]) -> ConditionKind:
    """Return what sort of thing a condition is about."""
    return next(each for each in _CONDITION_KINDS if each in condition)
