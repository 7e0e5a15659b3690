"""Declarations of what runs on the ROS graph."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from composer.application.running_systems.client import Client
from composer.entity_kinds import KIND_OF_SECTION
from composer.errors import ComposerError
from composer.names import join_names
from composer.ros_parameters.parameter_types import infer_parameter_type
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.runtime.middleware.graph_capture import CapturedEnd, CapturedNode
    from composer.yaml_text.positions import DataPath

_ORDER = tuple(KIND_OF_SECTION)
# Programs name these in full.
_ABSOLUTE = ('/clock', '/diagnostics', '/diagnostics_agg', '/tf', '/tf_static')
_COMMAND = ['ros2', 'run', 'PACKAGE', 'EXECUTABLE']
_ABOUT_COMMAND = 'which program this is, the ROS graph does not say'


def capture(nodes: Sequence[str], timeout_sec: float) -> tuple[str, list[CapturedNode]]:
    """Return what nodes on the ROS graph have, as text, and the nodes.

    Args:
        nodes: Full names, or names in any namespace; all nodes if there are none.
        timeout_sec: How long nodes may take to answer.

    Raises:
        ComposerError: There is no such node.
    """
    with Client() as client:
        # It needs ROS, which the client has found.
        from composer.runtime.middleware.graph_capture import NodesNotFoundError, capture_nodes

        try:
            found = capture_nodes(client.node, client.executor, nodes, timeout_sec)
        except NodesNotFoundError as error:
            message, help_text = error.args
            domain = f'ROS_DOMAIN_ID {client.domain_id}'
            msg = f'{message} ({domain})'
            raise ComposerError(msg, help=help_text) from error
        domain_id = client.domain_id
    return _render(found, domain_id), found


def _render(nodes: Sequence[CapturedNode], domain_id: int) -> str:
    often = Counter(node.name for node in nodes)
    processes: dict[str, Any] = {}
    remarks: dict[DataPath, str] = {}
    for node in nodes:
        key = node.name
        if often[key] > 1 or key in processes:
            key = node.full_name.strip('/').replace('/', '_')
        processes[key] = {
            'command': _COMMAND,
            'name': node.name,
            'namespace': node.namespace,
            'nodes': {node.name: _declare(node)},
        }
        remarks['processes', key, 'command'] = _ABOUT_COMMAND
        if node.problem:
            remarks['processes', key, 'name'] = node.problem
    title = f'# What composer capture found on the ROS graph (ROS_DOMAIN_ID {domain_id}).\n'
    document = {'version': 1, 'processes': processes}
    return title + render_yaml(document, remark=lambda path: remarks.get(path, ''))


def _declare(node: CapturedNode) -> dict[str, Any]:
    """Return a node as a declared one has it in the language."""
    data: dict[str, Any] = {}
    for section in _ORDER:
        ends = node.sections.get(section, ())
        if ends:
            data[section] = dict(_entries(node, section, ends))
    if node.parameters is not None:
        known = {
            name: _shortened(each) for name, each in node.parameters.items() if 'type' in each
        }
        # Of one without a type nothing can be declared: then these are not all.
        if len(known) == len(node.parameters):
            data['parameters'] = known
    return data


def _entries(
    node: CapturedNode, section: str, ends: Sequence[CapturedEnd]
) -> Iterator[tuple[str, Any]]:
    kind = KIND_OF_SECTION[section]
    channel = str(kind.channel)
    taken: Counter[str] = Counter()
    for end in ends:
        name = _relative(end.channel, node)
        taken[name] += 1
        entry: dict[str, Any] = {'type': end.type}
        key = name
        if taken[name] > 1:
            key, entry[channel] = f'{name}_{taken[name]}', name
        if end.qos:
            entry['qos'] = dict(end.qos)
        if end.is_alone and not kind.provides:
            entry['external'] = True
        yield key, entry if len(entry) > 1 else end.type


def _relative(full: str, node: CapturedNode) -> str:
    """Return a name as short as it can be in the namespace of a node."""
    if full.startswith(f'{node.full_name}/'):
        return f'~{full.removeprefix(node.full_name)}'
    inside = join_names(node.namespace, '')
    is_inside = full.startswith(inside) and full not in _ABSOLUTE
    return full.removeprefix(inside) if is_inside else full


def _shortened(declared: Any) -> Any:
    """Return a parameter as its value, if that tells its type, or as a declaration."""
    value = declared.get('default')
    is_plain = declared.keys() == {'type', 'default'}
    return (
        value if is_plain and infer_parameter_type(value) == declared['type'] else dict(declared)
    )
