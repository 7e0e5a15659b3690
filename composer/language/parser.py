"""Plain data that satisfy the schema → specs. Nothing is checked here that the schema checks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

from composer.language.parameters import convert_parameter_value, infer_parameter_type
from composer.language.processes import parse_conditions, parse_process, write_scalar
from composer.language.qos import DEFAULT_PROFILE, SERVICES_PROFILE
from composer.language.specs import (
    DEFAULT_DIAGNOSTICS_PERIOD_SEC,
    DEFAULT_SHUTDOWN_TIMEOUT_SEC,
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
    SystemSpec,
    TimerSpec,
)
from composer.names import expand_namespace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.positions import DataPath
    from composer.language.specs import OnError

Spec = TypeVar('Spec')
Data = dict[str, Any]


def parse_system(data: Data, name: str) -> SystemSpec:
    """Return the system that the data describe.

    Args:
        data: As the schema wants them.
        name: The file's name without its ending.
    """
    executor = data.get('executor', {})
    defaults = _parse_defaults(data.get('defaults', {}))
    return SystemSpec(
        name=name,
        description=data.get('description', ''),
        interfaces=MappingProxyType(data.get('interfaces', {})),
        qos=_parse_entries(data, (), 'qos', _parse_named_qos),
        threads=int(executor['threads']) if 'threads' in executor else None,
        shutdown_timeout_sec=float(executor.get('shutdown_timeout', DEFAULT_SHUTDOWN_TIMEOUT_SEC)),
        diagnostics_period_sec=_parse_diagnostics(data.get('diagnostics', True)),
        nodes=_parse_entries(
            data,
            (),
            'nodes',
            lambda name, node, path: _NodeParser(defaults, node, path).parse(name),
        ),
        environment=MappingProxyType(
            {name: write_scalar(value) for name, value in data.get('environment', {}).items()}
        ),
        processes=_parse_entries(
            data, (), 'processes', partial(parse_process, defaults.given_namespace, defaults.node)
        ),
    )


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


def _parse_diagnostics(data: bool | Data) -> float | None:  # noqa: FBT001 - as it is written
    if data is False:
        return None
    period = data.get('period') if isinstance(data, dict) else None
    return DEFAULT_DIAGNOSTICS_PERIOD_SEC if period is None else float(period)


@dataclass(frozen=True, slots=True)
class _Defaults:
    given_namespace: str | None
    namespace: str
    qos: QosSpec
    node: Data


def _parse_defaults(data: Data) -> _Defaults:
    return _Defaults(
        given_namespace=expand_namespace(data['namespace']) if 'namespace' in data else None,
        namespace=expand_namespace(data.get('namespace', '')),
        qos=_parse_qos(data['qos'], ('defaults', 'qos'))
        if 'qos' in data
        else QosSpec(DEFAULT_PROFILE, {}, ()),
        node={key: value for key, value in data.items() if key in _INHERITED},
    )


class _NodeParser:
    """Parses one node; what all its entities share is kept here."""

    def __init__(self, defaults: _Defaults, data: Data, path: DataPath) -> None:
        self._defaults = defaults
        self._data = defaults.node | data
        self._path = path
        self._on_error: OnError = self._data.get('on_error', 'log')

    def parse(self, key: str) -> NodeSpec:
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
            parameters=_parse_entries(data, path, 'parameters', _parse_parameter),
            state=MappingProxyType(data.get('state', {})),
            remap=tuple(data.get('remap', {}).items()),
            publishers=_parse_entries(data, path, 'publishers', self._parse_publisher),
            subscriptions=_parse_entries(data, path, 'subscriptions', self._parse_subscription),
            timers=_parse_entries(data, path, 'timers', self._parse_timer),
            services=_parse_entries(data, path, 'services', self._parse_service),
            service_clients=_parse_entries(
                data, path, 'service_clients', self._parse_service_client
            ),
            actions=_parse_entries(data, path, 'actions', self._parse_action),
            action_clients=_parse_entries(data, path, 'action_clients', _parse_action_client),
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
            behaviour=_parse_behaviour(data, path),
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
            behaviour=_parse_behaviour(data, path),
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
            qos=_parse_service_qos(data, path),
            behaviour=_behaviour_at(data, path, 'behaviour'),
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
            qos=_parse_service_qos(data, path),
            external=data.get('external', False),
            path=path,
        )

    def _parse_action(self, name: str, data: Data, path: DataPath) -> ActionSpec:
        return ActionSpec(
            name=name,
            type=data['type'],
            action=data.get('action', name),
            behaviour=_behaviour_at(data, path, 'behaviour'),
            accept=_behaviour_at(data, path, 'accept') if 'accept' in data else None,
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
        return _parse_qos(data['qos'], (*path, 'qos')) if 'qos' in data else self._defaults.qos

    def _parse_hook(self, key: str) -> BehaviourSpec | None:
        data = self._data.get(key)
        if isinstance(data, str):
            data = {'behaviour': data}
            return _parse_behaviour(data, self._path, (*self._path, key))
        return _parse_behaviour(data, (*self._path, key)) if data else None


def _has_parameters(node: Data) -> bool:
    return bool(node.get('parameters')) or 'on_parameters' in node


def _parse_entries(
    data: Data, path: DataPath, key: str, parse: Callable[[str, Any, DataPath], Spec]
) -> Mapping[str, Spec]:
    entries = data.get(key, {})
    return MappingProxyType(
        {name: parse(name, entry, (*path, key, name)) for name, entry in entries.items()}
    )


def _parse_behaviour(
    data: Data, path: DataPath, own_path: DataPath | None = None
) -> BehaviourSpec | None:
    if 'behaviour' not in data:
        return None
    spec = _behaviour_at(data, path, 'behaviour')
    return replace(spec, path=own_path) if own_path else spec


def _behaviour_at(data: Data, path: DataPath, key: str) -> BehaviourSpec:
    """Return the behaviour under a key; constant arguments go to `behaviour:` alone."""
    module, _, function = data[key].partition(':')
    arguments = data.get('with', {}) if key == 'behaviour' else {}
    return BehaviourSpec(module, function, MappingProxyType(arguments), (*path, key))


def _parse_action_client(name: str, data: str | Data, path: DataPath) -> ActionClientSpec:
    if isinstance(data, str):
        data = {'type': data}
    return ActionClientSpec(
        name=name,
        type=data['type'],
        action=data.get('action', name),
        feedback=_behaviour_at(data, path, 'feedback') if 'feedback' in data else None,
        result=_behaviour_at(data, path, 'result') if 'result' in data else None,
        external=data.get('external', False),
        path=path,
    )


def _parse_service_qos(data: Data, path: DataPath) -> QosSpec:
    # The QoS of defaults is for topics; rmw has a profile of its own for services.
    if 'qos' in data:
        return _parse_qos(data['qos'], (*path, 'qos'), SERVICES_PROFILE)
    return QosSpec(SERVICES_PROFILE, {}, ())


def _parse_named_qos(name: str, data: Data, path: DataPath) -> QosSpec:  # noqa: ARG001 - a parser of entries
    return _parse_qos(data, path)


def _parse_qos(data: float | str | Data, path: DataPath, base: str = DEFAULT_PROFILE) -> QosSpec:
    if isinstance(data, str):
        return QosSpec(data, {}, path)
    if not isinstance(data, dict):
        return QosSpec(base, {'depth': int(data)}, path)
    policies = {key: value for key, value in data.items() if key != 'profile'}
    if 'depth' in policies:
        policies['depth'] = int(policies['depth'])
    return QosSpec(data.get('profile', base), policies, path)


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
