"""What the page asks the graph for when somebody looks or acts: parameters, messages, calls."""

from __future__ import annotations

import json
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.interfaces.plain_messages import plain_message
from composer.runtime.control import protocol
from composer.runtime.messages.payload_texts import read_parameter, read_payload

if TYPE_CHECKING:
    from composer.application.running_systems.client import Client, RunningSystem
    from composer.page.recording import Recording

_ANSWER_SEC = 3.0
_RELOAD_SEC = 60.0
_MOST = 500
_LONGEST_TEXT = 100_000
_LONGEST_VALUE = 10_000


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
            **_describe_value(parameter_value_to_python(value)),
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

    type_name = _find_type(client, 'topic', topic)
    found: list[Any] = []
    ends = client.node.get_publishers_info_by_topic(topic)
    profile = match_offers(read_offer(each.qos_profile) for each in ends)
    message_class = import_message(type_name)
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
    return {'text': render_yaml(plain_message(found[0]))[:_LONGEST_TEXT], 'type': type_name}


def show_template(client: Client, kind: str, name: str) -> dict[str, Any]:
    """Return the fields of a message or a request, with their defaults, as `text` in YAML.

    Args:
        kind: `topic` or `service`.

    Raises:
        ComposerError: There is no such topic or service, or its type is not installed.
    """
    from composer.interfaces.classes import import_interface
    from composer.yaml_text.writer import render_yaml

    type_name = _find_type(client, kind, name)
    found: Any = import_interface(type_name)
    message = found.Request() if kind == 'service' else found()
    data = plain_message(message)
    return {'text': render_yaml(data) if data else '', 'type': type_name}


def act(
    client: Client, system: RunningSystem, wish: dict[str, str], recording: Recording
) -> dict[str, Any]:
    """Do what somebody wants, and return what came of it, as `text`.

    Args:
        wish: `action`: `reload`, `restart`, `stop`, `start`, `set`, `call`, `publish`, `record` or
            `end_record`; `name`: of a node, a service or a topic; `parameter`; `text`: a value or
            a payload, in YAML.

    Raises:
        ComposerError: It cannot be done, or what is wanted does not fit.
    """
    action, name, text = (wish.get(key, '') for key in ('action', 'name', 'text'))
    if action in ('reload', 'restart', 'stop', 'start'):
        outcome = (
            client.ask(system, protocol.RELOAD, _RELOAD_SEC)
            if action == 'reload'
            else client.restart(system, name, _RELOAD_SEC, action)
        )
        if not outcome.succeeded:
            raise ComposerError(outcome.text)
        return {'text': outcome.text or 'nothing has changed'}
    if action in ('record', 'end_record'):
        return {'text': recording.begin(client) if action == 'record' else recording.end()}
    done = {'set': _set, 'call': _call_service, 'publish': _publish}.get(action)
    if done is None:
        message = f"there is no action '{action}'"
        raise ComposerError(message)
    return {'text': done(client, name, text, wish.get('parameter', ''))}


def _set(client: Client, node: str, text: str, parameter: str) -> str:
    from rcl_interfaces.srv import GetParameterTypes, SetParameters

    asked = GetParameterTypes.Request(names=[parameter])
    types = _call(client, GetParameterTypes, f'{node}/get_parameter_types', asked).types
    request = SetParameters.Request(parameters=[read_parameter(parameter, text, types[0])])
    (result,) = _call(client, SetParameters, f'{node}/set_parameters', request).results
    if not result.successful:
        message = f'{node} refuses {parameter} = {text}: {result.reason or "without a reason"}'
        raise ComposerError(message)
    return f'{parameter} = {text}'


def _call_service(client: Client, service: str, text: str, _: str) -> str:
    from composer.interfaces.classes import import_interface
    from composer.yaml_text.writer import render_yaml

    service_class: Any = import_interface(_find_type(client, 'service', service))
    answer = _call(client, service_class, service, read_payload(text, service_class.Request))
    return render_yaml(plain_message(answer))[:_LONGEST_TEXT]


def _publish(client: Client, topic: str, text: str, _: str) -> str:
    from rclpy.duration import Duration
    from rclpy.qos import DurabilityPolicy, QoSProfile

    from composer.recordings.definitions import import_message

    message_class = import_message(_find_type(client, 'topic', topic))
    message = read_payload(text, message_class)
    ends = client.node.get_subscriptions_info_by_topic(topic)
    kept, profile = DurabilityPolicy.TRANSIENT_LOCAL, QoSProfile(depth=1)
    if any(each.qos_profile.durability == kept for each in ends):
        profile.durability = kept
    ros = client.node.create_publisher(message_class, topic, profile)
    try:
        deadline = monotonic() + _ANSWER_SEC
        while ros.get_subscription_count() < len(ends) and monotonic() < deadline:
            client.executor.spin_once(timeout_sec=0.05)
        ros.publish(message)
        # Else it would be gone before all have it; one that takes nothing holds nobody up.
        ros.wait_for_all_acked(Duration(seconds=_ANSWER_SEC))
    finally:
        client.node.destroy_publisher(ros)
    return f'published, to {len(ends)} subscriptions'


def _find_type(client: Client, kind: str, name: str) -> str:
    node = client.node
    listed = (
        node.get_service_names_and_types if kind == 'service' else node.get_topic_names_and_types
    )
    types = dict(listed()).get(name, [])
    if len(types) != 1:
        message = f"'{name}' has several types" if types else f"the graph has no {kind} '{name}'"
        raise ComposerError(message)
    return str(types[0])


def _range(descriptor: Any) -> list[float] | None:
    ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
    return [ranges[0].from_value, ranges[0].to_value] if ranges else None


def _describe_value(value: Any) -> dict[str, Any]:
    """Return a `value`, or the beginning of its text if it `is_cut`."""
    plain = _plain(value)
    text = json.dumps(plain)
    is_cut = len(text) > _LONGEST_VALUE
    return {'value': f'{text[:_LONGEST_VALUE]}…' if is_cut else plain, 'is_cut': is_cut}


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
