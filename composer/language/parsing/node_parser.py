"""A node as data that satisfy the schema → its spec."""

from __future__ import annotations

from dataclasses import MISSING, fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import NODE_BEHAVIOURS
from composer.language.parameter_files import parse_parameter_files
from composer.language.parsing.condition_parser import parse_conditions
from composer.language.parsing.entity_parser import parse_entities, parse_run_options
from composer.language.parsing.entry_parser import Data, parse_behaviour
from composer.language.specs import BehaviourSpec, LifecycleStart, NodeSpec
from composer.names import expand_namespace

if TYPE_CHECKING:
    from composer.yaml_text.positions import DataPath


_PLAIN_KEYS = [each.name for each in fields(NodeSpec) if each.default is not MISSING]


def parse_node(key: str, data: Data, path: DataPath) -> NodeSpec:
    """Return the node that the file calls `key`, which may be its full name."""
    namespace, _, name = key.rpartition('/')
    if not key.startswith('/'):
        namespace, name = expand_namespace(data.get('namespace', '')), key
    return NodeSpec(
        name=name,
        namespace=namespace or '/',
        state=MappingProxyType(data.get('state', {})),
        remap=tuple(data.get('remap', {}).items()),
        lifecycle=_parse_lifecycle(data.get('lifecycle', False)),
        wait_for=parse_conditions(data, path),
        delay_sec=float(data.get('delay', 0.0)),
        parameter_files=parse_parameter_files(data),
        followed=(),
        path=path,
        **{key: data[key] for key in _PLAIN_KEYS if key in data},
        **_parse_hooks(data, path),
        **parse_entities(data, path),
        **parse_run_options({}, data),
    )


def _parse_hooks(data: Data, path: DataPath) -> dict[str, Any]:
    return {each.key: _parse_hook(data, path, each.key) for each in NODE_BEHAVIOURS}


def _parse_lifecycle(data: bool | Data) -> LifecycleStart | None:  # noqa: FBT001 - as it is written
    if data is False:
        return None
    full: Data = data if isinstance(data, dict) else {}
    start: LifecycleStart = full.get('start', 'unconfigured')
    return start


def _parse_hook(node: Data, path: DataPath, key: str) -> BehaviourSpec | None:
    data = node.get(key)
    if not isinstance(data, str):
        return parse_behaviour(data, (*path, key)) if data else None
    spec = parse_behaviour({'behaviour': data}, path)
    return spec and replace(spec, path=(*path, key))
