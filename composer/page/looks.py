"""What the page asks the graph for when somebody looks: parameters of a node, a message."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.interfaces.plain_messages import plain_message

if TYPE_CHECKING:
    from composer.application.running_systems.client import Client

_ANSWER_SEC = 3.0
_MOST = 500
_LONGEST_TEXT = 100_000


def list_parameters(client: Client, node: str) -> list[dict[str, Any]]:
    """Return name, value, description, range and whether it may be set, of each.

    Raises:
        ComposerError: The node does not answer.
    """
    from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
    from rclpy.parameter import parameter_value_to_python

    listed = _call(client, ListParameters, f'{node}/list_parameters', ListParameters.Request())
    names = sorted(listed.result.names)[:_MOST]
    request = DescribeParameters.Request(names=names)
    described = _call(client, DescribeParameters, f'{node}/describe_parameters', request)
    got = GetParameters.Request(names=names)
    values = _call(client, GetParameters, f'{node}/get_parameters', got).values
    return [
        {
            'name': each.name,
            'value': _plain(parameter_value_to_python(value)),
            'description': each.description,
            'read_only': each.read_only,
            'range': _range(each),
        }
        for each, value in zip(described.descriptors, values, strict=False)
    ]


def look_at_message(client: Client, topic: str) -> dict[str, Any]:
    """Return a message of a topic as `text`, in YAML, and its `type`.

    Raises:
        ComposerError: None came, or its type is not installed.
    """
    from composer.recordings.definitions import import_message
    from composer.recordings.graph_recorder import match_offers, read_offer
    from composer.yaml_text.writer import render_yaml

    types = dict(client.node.get_topic_names_and_types()).get(topic, [])
    if len(types) != 1:
        message = f"the graph has no topic '{topic}'" if not types else 'it has several types'
        raise ComposerError(message)
    found: list[Any] = []
    ends = client.node.get_publishers_info_by_topic(topic)
    profile = match_offers(read_offer(each.qos_profile) for each in ends)
    message_class = import_message(types[0])
    ros = client.node.create_subscription(message_class, topic, found.append, profile)
    try:
        deadline = monotonic() + _ANSWER_SEC
        while not found and monotonic() < deadline:
            client.executor.spin_once(timeout_sec=0.05)
    finally:
        client.node.destroy_subscription(ros)
    if not found:
        message = f'no message came within {_ANSWER_SEC:g} s'
        raise ComposerError(message)
    return {'text': render_yaml(plain_message(found[0]))[:_LONGEST_TEXT], 'type': types[0]}


def _range(descriptor: Any) -> list[float] | None:
    ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
    return [ranges[0].from_value, ranges[0].to_value] if ranges else None


def _plain(value: Any) -> Any:
    """Return a value as JSON has it."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return [_plain(each) for each in (value if not isinstance(value, bytes) else list(value))]


def _call(client: Client, service: Any, name: str, request: Any) -> Any:
    ros = client.node.create_client(service, name)
    try:
        deadline = monotonic() + _ANSWER_SEC
        while not ros.service_is_ready():
            if monotonic() > deadline:
                message = f'{name} does not answer'
                raise ComposerError(message)
            client.executor.spin_once(timeout_sec=0.05)
        future = ros.call_async(request)
        client.executor.spin_until_future_complete(future, _ANSWER_SEC)
        if not future.done():
            message = f'{name} does not answer'
            raise ComposerError(message)
        return future.result()
    finally:
        client.node.destroy_client(ros)
