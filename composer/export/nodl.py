"""Nodes of a system as NoDL documents of version 2, for whoever uses them without Composer.

Source: `nodl_schema/schemas/` of https://github.com/ros-tooling/nodl
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.export.documents import render_document
from composer.language.qos import DURATIONS, NANOSECONDS, resolve_qos

if TYPE_CHECKING:
    from composer.language.specs import NodeSpec, ParameterSpec, QosSpec, SystemSpec

_SECTIONS = {
    'publishers': 'publishers',
    'subscriptions': 'subscriptions',
    'services': 'service_servers',
    'service_clients': 'service_clients',
    'actions': 'action_servers',
    'action_clients': 'action_clients',
}
_POLICIES = ('history', 'reliability', 'durability', 'liveliness')
_TYPES = {'integer': 'int', 'integer_array': 'int_array'}


def render_nodl(spec: SystemSpec) -> dict[str, str]:
    """Return a document for each node of a system, by names of files."""
    return {
        f'{node.full_name.strip("/").replace("/", "__")}.nodl.yaml': render_document(
            _describe(spec, node)
        )
        for node in spec.nodes.values()
    }


def _describe(spec: SystemSpec, node: NodeSpec) -> dict[str, Any]:
    found: dict[str, Any] = {'nodl_version': 2}
    if node.description:
        found['description'] = node.description
    # Without a type, nobody knows one before it is set.
    parameters = {
        name: _describe_parameter(each) for name, each in node.parameters.items() if each.type
    }
    if parameters:
        found['parameters'] = parameters
    for kind, end in node.ends():
        entry: dict[str, Any] = {'name': getattr(end, str(kind.channel)), 'type': end.type}
        qos: QosSpec | None = getattr(end, 'qos', None)
        if qos is not None:
            entry['qos'] = _describe_qos(spec, qos)
        found.setdefault(_SECTIONS[kind.section], []).append(entry)
    return found


def _describe_parameter(parameter: ParameterSpec) -> dict[str, Any]:
    found: dict[str, Any] = {'type': _TYPES.get(str(parameter.type), parameter.type)}
    if parameter.value is not None:
        value = parameter.value
        found['default_value'] = list(value) if isinstance(value, list | tuple | bytes) else value
    if parameter.description:
        found['description'] = parameter.description
    if parameter.read_only:
        found['read_only'] = True
    rules: dict[str, Any] = {}
    if parameter.minimum is not None:
        rules['gt_eq<>'] = [parameter.minimum]
    if parameter.maximum is not None:
        rules['lt_eq<>'] = [parameter.maximum]
    if parameter.choices:
        rules['one_of<>'] = [list(parameter.choices)]
    return found | ({'validation': rules} if rules else {})


def _describe_qos(spec: SystemSpec, qos: QosSpec) -> dict[str, Any]:
    policies = resolve_qos(qos, spec.qos)
    found: dict[str, Any] = {
        policy: str(policies[policy]).upper() for policy in _POLICIES if policy in policies
    }
    if policies.get('history') == 'keep_last' and policies.get('depth'):
        found['depth'] = policies['depth']
    for policy in DURATIONS:
        value = policies.get(policy)
        if isinstance(value, int | float):
            found[f'{policy}_ns'] = round(value * NANOSECONDS)
    return found
