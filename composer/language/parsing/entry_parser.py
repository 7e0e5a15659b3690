"""Parts that entries of several sections have: names, behaviours, QoS."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from composer.language.qos import DEFAULT_PROFILE, SERVICES_PROFILE
from composer.language.specs import BehaviourSpec, QosSpec

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.yaml_text.positions import DataPath

Spec = TypeVar('Spec')
Data = dict[str, Any]


def parse_entries(
    data: Data, path: DataPath, key: str, parse: Callable[[str, Any, DataPath], Spec]
) -> Mapping[str, Spec]:
    """Return the specs of all entries of a mapping, by name."""
    entries = data.get(key, {})
    return MappingProxyType(
        {name: parse(name, entry, (*path, key, name)) for name, entry in entries.items()}
    )


def parse_behaviour(data: Data, path: DataPath, key: str = 'behaviour') -> BehaviourSpec | None:
    """Return the behaviour under a key, if there is one; `with:` is for `behaviour:` alone."""
    return behaviour_at(data, path, key) if key in data else None


def behaviour_at(data: Data, path: DataPath, key: str = 'behaviour') -> BehaviourSpec:
    """Return the behaviour under a key that is there."""
    module, _, function = data[key].partition(':')
    arguments = data.get('with', {}) if key == 'behaviour' else {}
    return BehaviourSpec(module, function, MappingProxyType(arguments), (*path, key))


def parse_qos(data: float | str | Data, path: DataPath, base: str = DEFAULT_PROFILE) -> QosSpec:
    """Return the QoS that is written at a path: a depth, a name, or policies."""
    if isinstance(data, str):
        return QosSpec(data, {}, path)
    if not isinstance(data, dict):
        return QosSpec(base, {'depth': int(data)}, path)
    policies = {key: value for key, value in data.items() if key != 'profile'}
    if 'depth' in policies:
        policies['depth'] = int(policies['depth'])
    return QosSpec(data.get('profile', base), policies, path)


def parse_entity_qos(data: Data, path: DataPath, *, is_service: bool = False) -> QosSpec:
    """Return the QoS of an entity; services have a profile of their own, as in rmw."""
    base = SERVICES_PROFILE if is_service else DEFAULT_PROFILE
    if 'qos' in data:
        return parse_qos(data['qos'], (*path, 'qos'), base)
    return QosSpec(base, {}, ())
