"""A node as data that satisfy the schema → its spec."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from composer.language.parsing.entity_parser import parse_entities, parse_run_options
from composer.language.parsing.entry_parser import Data, parse_behaviour
from composer.language.parsing.process_parser import parse_conditions
from composer.language.specs import BehaviourSpec, NodeSpec
from composer.names import expand_namespace

if TYPE_CHECKING:
    from composer.yaml_text.positions import DataPath


def parse_node(key: str, data: Data, path: DataPath) -> NodeSpec:
    """Return the node that the file calls `key`, which may be its full name."""
    namespace, _, name = key.rpartition('/')
    if not key.startswith('/'):
        namespace, name = expand_namespace(data.get('namespace', '')), key
    return NodeSpec(
        name=name,
        namespace=namespace or '/',
        description=data.get('description', ''),
        log_level=data.get('log_level'),
        use_sim_time=data.get('use_sim_time', False),
        parameter_services=data.get('parameter_services', _has_parameters(data)),
        rosout=data.get('rosout', True),
        type_description_service=data.get('type_description_service', False),
        logger_services=data.get('logger_services', False),
        state=MappingProxyType(data.get('state', {})),
        remap=tuple(data.get('remap', {}).items()),
        on_start=_parse_hook(data, path, 'on_start'),
        on_stop=_parse_hook(data, path, 'on_stop'),
        on_parameters=_parse_hook(data, path, 'on_parameters'),
        wait_for=parse_conditions(data, path),
        parameter_files=tuple(data.get('parameter_files', ())),
        path=path,
        **parse_entities(data, path),
        **parse_run_options({}, data),
    )


def _has_parameters(node: Data) -> bool:
    return bool(node.get('parameters')) or 'on_parameters' in node


def _parse_hook(node: Data, path: DataPath, key: str) -> BehaviourSpec | None:
    data = node.get(key)
    if not isinstance(data, str):
        return parse_behaviour(data, (*path, key)) if data else None
    spec = parse_behaviour({'behaviour': data}, path)
    return spec and replace(spec, path=(*path, key))
