"""Parts that entries of several sorts have: names, behaviours, QoS."""

from __future__ import annotations

from dataclasses import replace
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


def parse_behaviour(
    data: Data, path: DataPath, own_path: DataPath | None = None
) -> BehaviourSpec | None:
    """Return the behaviour of an entry, if it has one."""
    if 'behaviour' not in data:
        return None
    spec = behaviour_at(data, path, 'behaviour')
    return replace(spec, path=own_path) if own_path else spec


def behaviour_at(data: Data, path: DataPath, key: str) -> BehaviourSpec:
    """Return the behaviour under a key; constant arguments go to `behaviour:` alone."""
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


def parse_service_qos(data: Data, path: DataPath) -> QosSpec:
    """Return the QoS of a service or its client."""
    # The QoS of defaults is for topics; rmw has a profile of its own for services.
    if 'qos' in data:
        return parse_qos(data['qos'], (*path, 'qos'), SERVICES_PROFILE)
    return QosSpec(SERVICES_PROFILE, {}, ())
