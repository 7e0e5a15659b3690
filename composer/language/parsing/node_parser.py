"""A node as data that satisfy the schema → its spec."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.language.parsing.entry_parser import (
    Data,
    behaviour_at,
    parse_behaviour,
    parse_entries,
    parse_qos,
    parse_service_qos,
)
from composer.language.parsing.process_parser import parse_conditions
from composer.language.qos import DEFAULT_PROFILE
from composer.language.specs import (
    DEFAULT_WARN_AFTER_SEC,
    ActionClientSpec,
    ActionSpec,
    BehaviourSpec,
    NodeSpec,
    ParameterSpec,
    PublisherSpec,
    QosSpec,
    ServiceClientSpec,
    ServiceSpec,
    SubscriptionSpec,
    TimerSpec,
)
from composer.names import expand_namespace
from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type

if TYPE_CHECKING:
    from composer.language.specs import OnError
    from composer.yaml_text.positions import DataPath

_INHERITED = frozenset(
    {
        'log_level',
        'use_sim_time',
        'on_error',
        'warn_after',
        'parameter_services',
        'rosout',
        'type_description_service',
        'logger_services',
    }
)


@dataclass(frozen=True, slots=True)
class NodeDefaults:
    """What holds for the nodes of a file that do not say otherwise."""

    given_namespace: str | None
    namespace: str
    qos: QosSpec
    node: Data


def parse_defaults(data: Data) -> NodeDefaults:
    """Return the defaults of a file."""
    return NodeDefaults(
        given_namespace=expand_namespace(data['namespace']) if 'namespace' in data else None,
        namespace=expand_namespace(data.get('namespace', '')),
        qos=parse_qos(data['qos'], ('defaults', 'qos'))
        if 'qos' in data
        else QosSpec(DEFAULT_PROFILE, {}, ()),
        node={key: value for key, value in data.items() if key in _INHERITED},
    )


class NodeParser:
    """Parses one node; what all its entities share is kept here."""

    def __init__(self, defaults: NodeDefaults, data: Data, path: DataPath) -> None:
        self._defaults = defaults
        self._data = defaults.node | data
        self._path = path
        self._on_error: OnError = self._data.get('on_error', 'log')

    def parse(self, key: str) -> NodeSpec:
        """Return the node that the file calls `key`."""
        data, path = self._data, self._path
        namespace, name = self._split(key)
        return NodeSpec(
            name=name,
            namespace=namespace,
            description=data.get('description', ''),
            log_level=data.get('log_level'),
            use_sim_time=data.get('use_sim_time', False),
            parameter_services=data.get('parameter_services', _has_parameters(data)),
            rosout=data.get('rosout', True),
            type_description_service=data.get('type_description_service', False),
            logger_services=data.get('logger_services', False),
            on_error=self._on_error,
            warn_after_sec=self._warn_after_sec({}),
            parameters=parse_entries(data, path, 'parameters', _parse_parameter),
            state=MappingProxyType(data.get('state', {})),
            remap=tuple(data.get('remap', {}).items()),
            publishers=parse_entries(data, path, 'publishers', self._parse_publisher),
            subscriptions=parse_entries(data, path, 'subscriptions', self._parse_subscription),
            timers=parse_entries(data, path, 'timers', self._parse_timer),
            services=parse_entries(data, path, 'services', self._parse_service),
            service_clients=parse_entries(
                data, path, 'service_clients', self._parse_service_client
            ),
            actions=parse_entries(data, path, 'actions', self._parse_action),
            action_clients=parse_entries(data, path, 'action_clients', _parse_action_client),
            on_start=self._parse_hook('on_start'),
            on_stop=self._parse_hook('on_stop'),
            on_parameters=self._parse_hook('on_parameters'),
            wait_for=parse_conditions(data, path),
            parameter_files=tuple(data.get('parameter_files', ())),
            path=path,
        )

    def _split(self, key: str) -> tuple[str, str]:
        """Return the namespace and the name of a node; its key may be both in one."""
        if key.startswith('/'):
            namespace, _, name = key.rpartition('/')
            return namespace or '/', name
        return expand_namespace(self._data.get('namespace', ''), self._defaults.namespace), key

    def _parse_publisher(self, name: str, data: str | Data, path: DataPath) -> PublisherSpec:
        if isinstance(data, str):
            data = {'type': data}
        return PublisherSpec(
            name=name,
            type=data['type'],
            topic=data.get('topic', name),
            qos=self._parse_entity_qos(data, path),
            external=data.get('external', False),
            path=path,
        )

    def _parse_subscription(self, name: str, data: Data, path: DataPath) -> SubscriptionSpec:
        return SubscriptionSpec(
            name=name,
            type=data['type'],
            topic=data.get('topic', name),
            qos=self._parse_entity_qos(data, path),
            behaviour=parse_behaviour(data, path),
            publish=data.get('publish'),
            group=data.get('group'),
            on_error=data.get('on_error', self._on_error),
            external=data.get('external', False),
            warn_after_sec=self._warn_after_sec(data),
            path=path,
        )

    def _parse_timer(self, name: str, data: Data, path: DataPath) -> TimerSpec:
        return TimerSpec(
            name=name,
            period_sec=float(data['period']) if 'period' in data else 1.0 / data['rate'],
            behaviour=parse_behaviour(data, path),
            publish=data.get('publish'),
            message=data.get('message'),
            clock=data.get('clock', 'ros'),
            group=data.get('group'),
            on_error=data.get('on_error', self._on_error),
            warn_after_sec=self._warn_after_sec(data),
            path=path,
        )

    def _parse_service(self, name: str, data: Data, path: DataPath) -> ServiceSpec:
        return ServiceSpec(
            name=name,
            type=data['type'],
            service=data.get('service', name),
            qos=parse_service_qos(data, path),
            behaviour=behaviour_at(data, path, 'behaviour'),
            group=data.get('group'),
            on_error=data.get('on_error', self._on_error),
            warn_after_sec=self._warn_after_sec(data),
            path=path,
        )

    def _parse_service_client(
        self, name: str, data: str | Data, path: DataPath
    ) -> ServiceClientSpec:
        if isinstance(data, str):
            data = {'type': data}
        return ServiceClientSpec(
            name=name,
            type=data['type'],
            service=data.get('service', name),
            qos=parse_service_qos(data, path),
            external=data.get('external', False),
            path=path,
        )

    def _parse_action(self, name: str, data: Data, path: DataPath) -> ActionSpec:
        return ActionSpec(
            name=name,
            type=data['type'],
            action=data.get('action', name),
            behaviour=behaviour_at(data, path, 'behaviour'),
            accept=behaviour_at(data, path, 'accept') if 'accept' in data else None,
            concurrency=data.get('concurrency', 'parallel'),
            on_error=data.get('on_error', self._on_error),
            warn_after_sec=self._warn_after_sec(data),
            path=path,
        )

    def _warn_after_sec(self, data: Data) -> float | None:
        inherited = self._data.get('warn_after', DEFAULT_WARN_AFTER_SEC)
        value = data.get('warn_after', inherited)
        return None if value is None else float(value)

    def _parse_entity_qos(self, data: Data, path: DataPath) -> QosSpec:
        return parse_qos(data['qos'], (*path, 'qos')) if 'qos' in data else self._defaults.qos

    def _parse_hook(self, key: str) -> BehaviourSpec | None:
        data = self._data.get(key)
        if isinstance(data, str):
            data = {'behaviour': data}
            return parse_behaviour(data, self._path, (*self._path, key))
        return parse_behaviour(data, (*self._path, key)) if data else None


def _has_parameters(node: Data) -> bool:
    return bool(node.get('parameters')) or 'on_parameters' in node


def _parse_action_client(name: str, data: str | Data, path: DataPath) -> ActionClientSpec:
    if isinstance(data, str):
        data = {'type': data}
    return ActionClientSpec(
        name=name,
        type=data['type'],
        action=data.get('action', name),
        feedback=behaviour_at(data, path, 'feedback') if 'feedback' in data else None,
        result=behaviour_at(data, path, 'result') if 'result' in data else None,
        external=data.get('external', False),
        path=path,
    )


def _parse_parameter(name: str, data: Any, path: DataPath) -> ParameterSpec:
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
