"""The entities of a node → specs: one parser for each kind of entity."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypedDict

from composer.entity_kinds import KIND_OF_SECTION
from composer.language.parsing.entry_parser import (
    Data,
    behaviour_at,
    parse_behaviour,
    parse_entity_qos,
    parse_entries,
)
from composer.language.parsing.parameter_references import take_references
from composer.language.specs import (
    DEFAULT_WARN_AFTER_SEC,
    ActionClientSpec,
    ActionSpec,
    ParameterSpec,
    PublisherSpec,
    ServiceClientSpec,
    ServiceSpec,
    SourceSpec,
    SubscriptionSpec,
    TimerSpec,
)
from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import OnError
    from composer.yaml_text.positions import DataPath


# Those of `QoSOverridingOptions.with_default_policies` of rclpy.
_USUAL_OVERRIDES = ('history', 'depth', 'reliability')


def parse_entities(node: Data, path: DataPath) -> dict[str, Any]:
    """Return the specs of all entities of a node, by section and name."""
    return {
        section: parse_entries(node, path, section, partial(parse_entity, section, node))
        for section in _PARSERS
    }


def parse_entity(section: str, node: Data, name: str, data: Any, path: DataPath) -> Any:
    """Return the spec of one entity of a node."""
    if section == 'parameters' or not isinstance(data, dict):
        return _PARSERS[section](node, name, data, path)
    data, references = take_references(name, data, path)
    spec = _PARSERS[section](node, name, data, path)
    return replace(spec, by_parameter=references) if references else spec


class RunOptions(TypedDict):
    """Options of an entity with behaviours: its own, or those of its node."""

    on_error: OnError
    warn_after_sec: float | None


def parse_run_options(data: Data, node: Data) -> RunOptions:
    """Return how behaviours of an entity, or of its node, are run."""
    warn_after = data.get('warn_after', node.get('warn_after', DEFAULT_WARN_AFTER_SEC))
    on_error: OnError = data.get('on_error') or node.get('on_error', 'log')
    return {
        'on_error': on_error,
        'warn_after_sec': None if warn_after is None else float(warn_after),
    }


def _allows_local_delivery(data: Data, node: Data) -> bool:
    return bool(data.get('local_delivery', node.get('local_delivery', True)))


def parse_parameter(_: Data, name: str, data: Any, path: DataPath) -> ParameterSpec:
    """Return a parameter that is declared, or written as its value."""
    declaration = data if isinstance(data, dict) else {'default': data}
    value = declaration.get('default')
    type_name = declaration.get('type') or infer_parameter_type(value)
    choices = declaration.get('choices')
    return ParameterSpec(
        name=name,
        type=type_name,
        value=convert_parameter_value(value, type_name),
        description=declaration.get('description', ''),
        read_only=declaration.get('read_only', False),
        minimum=declaration.get('minimum'),
        maximum=declaration.get('maximum'),
        step=declaration.get('step'),
        choices=None
        if choices is None
        else tuple(convert_parameter_value(choice, type_name) for choice in choices),
        path=path,
    )


def _parse_publisher(node: Data, name: str, data: str | Data, path: DataPath) -> PublisherSpec:
    data = _full(data)
    return PublisherSpec(
        name=name,
        type=data['type'],
        topic=data.get('topic', name),
        qos=parse_entity_qos(data, path),
        qos_overrides=_parse_overrides(data.get('qos_overrides', False)),
        local_delivery=_allows_local_delivery(data, node) and 'made_by' not in data,
        external=data.get('external', False),
        active=data.get('active', True),
        made_by=data.get('made_by', ''),
        **_parse_events('publishers', data, path),
        path=path,
    )


def _parse_subscription(node: Data, name: str, data: Data, path: DataPath) -> SubscriptionSpec:
    return SubscriptionSpec(
        name=name,
        type=data['type'],
        topic=data.get('topic', name),
        qos=parse_entity_qos(data, path),
        qos_overrides=_parse_overrides(data.get('qos_overrides', False)),
        raw=data.get('raw', False),
        content_filter=MappingProxyType(data.get('content_filter', {})),
        behaviour=parse_behaviour(data, path),
        publish=data.get('publish'),
        group=data.get('group'),
        read_only=data.get('read_only', False),
        while_inactive=data.get('while_inactive'),
        external=data.get('external', False),
        active=data.get('active', True),
        made_by=data.get('made_by', ''),
        **_parse_events('subscriptions', data, path),
        path=path,
        **parse_run_options(data, node),
    )


def _parse_timer(node: Data, name: str, data: Data, path: DataPath) -> TimerSpec:
    return TimerSpec(
        name=name,
        period_sec=float(data['period']) if 'period' in data else 1.0 / data['rate'],
        behaviour=parse_behaviour(data, path),
        publish=data.get('publish'),
        message=data.get('message'),
        clock=data.get('clock', 'ros'),
        group=data.get('group'),
        path=path,
        **parse_run_options(data, node),
    )


def _parse_source(node: Data, name: str, data: Data, path: DataPath) -> SourceSpec:
    # It waits by nature: only a limit of its own counts.
    options = parse_run_options({'warn_after': None} | data, node)
    return SourceSpec(
        name=name,
        behaviour=behaviour_at(data, path),
        cancel=parse_behaviour(data, path, 'cancel'),
        publish=data.get('publish'),
        path=path,
        **options,
    )


def _parse_service(node: Data, name: str, data: Data, path: DataPath) -> ServiceSpec:
    return ServiceSpec(
        name=name,
        type=data['type'],
        service=data.get('service', name),
        qos=parse_entity_qos(data, path, is_service=True),
        behaviour=behaviour_at(data, path),
        group=data.get('group'),
        while_inactive=data.get('while_inactive'),
        introspection=data.get('introspection', 'off'),
        local_delivery=_allows_local_delivery(data, node),
        path=path,
        **parse_run_options(data, node),
    )


def _parse_service_client(
    node: Data, name: str, data: str | Data, path: DataPath
) -> ServiceClientSpec:
    data = _full(data)
    return ServiceClientSpec(
        name=name,
        type=data['type'],
        service=data.get('service', name),
        qos=parse_entity_qos(data, path, is_service=True),
        introspection=data.get('introspection', 'off'),
        local_delivery=_allows_local_delivery(data, node),
        external=data.get('external', False),
        path=path,
    )


def _parse_action(node: Data, name: str, data: Data, path: DataPath) -> ActionSpec:
    return ActionSpec(
        name=name,
        type=data['type'],
        action=data.get('action', name),
        behaviour=behaviour_at(data, path),
        accept=parse_behaviour(data, path, 'accept'),
        concurrency=data.get('concurrency', 'parallel'),
        local_delivery=_allows_local_delivery(data, node),
        path=path,
        **parse_run_options(data, node),
    )


def _parse_action_client(
    node: Data, name: str, data: str | Data, path: DataPath
) -> ActionClientSpec:
    data = _full(data)
    return ActionClientSpec(
        name=name,
        type=data['type'],
        action=data.get('action', name),
        feedback=parse_behaviour(data, path, 'feedback'),
        result=parse_behaviour(data, path, 'result'),
        local_delivery=_allows_local_delivery(data, node),
        external=data.get('external', False),
        path=path,
    )


def _parse_overrides(data: Any) -> tuple[str, ...]:
    if isinstance(data, bool):
        return _USUAL_OVERRIDES if data else ()
    return tuple(data)


def _parse_events(section: str, data: Data, path: DataPath) -> dict[str, Any]:
    """Return the behaviours for QoS events, by their keys."""
    keys = [each.key for each in KIND_OF_SECTION[section].behaviours if each.key != 'behaviour']
    return {key: parse_behaviour(data, path, key) for key in keys}


def _full(data: str | Data) -> Data:
    """Return an entity as a mapping; it may be written as its type alone."""
    return {'type': data} if isinstance(data, str) else data


_PARSERS: dict[str, Callable[[Data, str, Any, DataPath], Any]] = {
    'parameters': parse_parameter,
    'publishers': _parse_publisher,
    'subscriptions': _parse_subscription,
    'timers': _parse_timer,
    'sources': _parse_source,
    'services': _parse_service,
    'service_clients': _parse_service_client,
    'actions': _parse_action,
    'action_clients': _parse_action_client,
}
