"""What the page asks the graph for when somebody looks or acts: parameters, messages, calls."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.application.running_systems.live_graph import LiveGraph
from composer.errors import ComposerError
from composer.interfaces.classes import interface_name
from composer.interfaces.plain_messages import plain_message
from composer.names import count_of
from composer.runtime.control import protocol
from composer.runtime.messages.payload_texts import read_payload
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from composer.application.running_systems.client import Client, RunningSystem
    from composer.recordings.system_recorder import SystemRecorder

_ANSWER_SEC = 3.0
_RELOAD_SEC = 60.0
_MOST = 500
_LONGEST_VALUE = 10_000
# The bytes of a pixel, and which of them are red, green and blue.
_ENCODINGS = {
    'rgb8': (3, [0, 1, 2]),
    'bgr8': (3, [2, 1, 0]),
    'rgba8': (4, [0, 1, 2]),
    'bgra8': (4, [2, 1, 0]),
    'mono8': (1, [0, 0, 0]),
}
_MOST_PIXELS = 144


def list_parameters(client: Client, node: str) -> list[dict[str, Any]]:
    """Return name, value, description, range and whether it may be set, of each.

    Raises:
        ComposerError: There is no such node, or it does not answer.
    """
    from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
    from rclpy.parameter import parameter_value_to_python

    def ask(service: str, service_class: Any, **asked: list[str]) -> Any:
        return graph.call(f'{node}/{service}', service_class, service_class.Request(**asked))

    graph = LiveGraph(client, _ANSWER_SEC)
    node = graph.find_node(node)
    names = sorted(ask('list_parameters', ListParameters).result.names)[:_MOST]
    descriptors = ask('describe_parameters', DescribeParameters, names=names).descriptors
    values = ask('get_parameters', GetParameters, names=names).values
    return [
        {
            'name': descriptor.name,
            **_describe_value(parameter_value_to_python(value)),
            'description': descriptor.description,
            'read_only': descriptor.read_only,
            'range': _range(descriptor),
        }
        for descriptor, value in zip(descriptors, values, strict=False)
    ]


def look_at_message(client: Client, topic: str) -> dict[str, Any]:
    """Return a message of a topic as `text`, in YAML, and the `image` that it may be.

    Raises:
        ComposerError: None came, or its type is not installed.
    """
    graph = LiveGraph(client, _ANSWER_SEC)
    name, message_class = graph.find('topic', topic)
    messages: list[Any] = []
    ros = graph.subscribe(name, message_class, messages.append)
    try:
        if not graph.wait_for(lambda: messages):
            message = f'no message came within {_ANSWER_SEC:g} s'
            raise ComposerError(message)
    finally:
        client.node.destroy_subscription(ros)
    return {'text': _render(messages[0]), 'image': show_small(messages[0])}


def show_small(message: Any) -> dict[str, Any] | None:
    """Return `width`, `height` and `rgb`, in base64, of an image, of at most 144 by 144 pixels.

    Returns:
        `None` if it is none, or has another encoding or less data than it says.
    """
    if interface_name(type(message)) != 'sensor_msgs/msg/Image':
        return None
    import numpy as np

    size, colours = _ENCODINGS.get(message.encoding, (0, []))
    height, width, step = message.height, message.width, message.step
    if not (size and height and width) or step < width * size or len(message.data) < height * step:
        return None
    rows = np.frombuffer(message.data, np.uint8, height * step).reshape(height, step)
    every = -(-max(width, height) // _MOST_PIXELS)
    pixels = rows[::every, : width * size].reshape(-1, width, size)[:, ::every, colours]
    data = base64.b64encode(pixels.tobytes()).decode()
    return {'width': pixels.shape[1], 'height': pixels.shape[0], 'rgb': data}


def show_template(client: Client, kind: str, name: str) -> dict[str, Any]:
    """Return the `type` and the fields of a message or a request, as `text` in YAML.

    Args:
        kind: `topic` or `service`.

    Raises:
        ComposerError: There is no such topic or service, or its type is not installed.
    """
    _, interface = LiveGraph(client, _ANSWER_SEC).find(kind, name)
    message = interface.Request() if kind == 'service' else interface()
    text = _render(message) if message.get_fields_and_field_types() else ''
    return {'text': text, 'type': interface_name(interface)}


class Recording:
    """Records the ROS graph, each time into a new folder of rosbag2 in the current folder.

    Attributes:
        target: What is written now; empty if nothing is.
        told: What was said of it.
    """

    def __init__(self) -> None:
        self.target = self.told = ''
        self._recorder: SystemRecorder | None = None

    def begin(self, client: Client) -> str:
        """Begin, and return what is written.

        Raises:
            ComposerError: One is under way, or the file cannot be written.
        """
        from composer.recordings.recording_place import new_folder
        from composer.recordings.system_recorder import create_recorder

        if self.target:
            message = f"'{self.target}' is being recorded already"
            raise ComposerError(message)
        target = Path.cwd() / new_folder()
        recorder = create_recorder(target, (), self)
        try:
            recorder.start(client.node.context)
        except Exception:
            recorder.stop()
            raise
        self._recorder, self.target = recorder, str(target)
        return f"recording to '{target}'"

    def end(self) -> str:
        """End it, and return what became of it.

        Raises:
            ComposerError: Nothing is recorded.
        """
        if self._recorder is None:
            message = 'nothing is recorded'
            raise ComposerError(message)
        self.told = ''
        self._recorder.stop()
        self._recorder, self.target = None, ''
        return self.told

    def info(self, message: str) -> None:
        """Note what is said: at the end what was recorded, and then what was not."""
        self.told = f'{self.told}; {message}' if self.told else message

    warning = error = info


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
    graph = LiveGraph(client, _ANSWER_SEC)
    if action in ('reload', 'restart', 'stop', 'start'):
        outcome = (
            client.ask(system, protocol.RELOAD, _RELOAD_SEC)
            if action == 'reload'
            else client.restart(system, name, _RELOAD_SEC, action)
        )
        if not outcome.succeeded:
            raise ComposerError(outcome.text)
        told = outcome.text or 'nothing has changed'
    elif action in ('record', 'end_record'):
        told = recording.begin(client) if action == 'record' else recording.end()
    elif action == 'set':
        parameter = wish.get('parameter', '')
        graph.set_parameter(name, parameter, text)
        told = f'{parameter} = {text}'
    elif action == 'call':
        service, service_class = graph.find('service', name)
        request = read_payload(text, service_class.Request)
        told = _render(graph.call(service, service_class, request))
    elif action == 'publish':
        told = _publish(graph, name, text)
    else:
        message = f"there is no action '{action}'"
        raise ComposerError(message)
    return {'text': told}


def _publish(graph: LiveGraph, topic: str, text: str) -> str:
    from rclpy.duration import Duration
    from rclpy.qos import DurabilityPolicy, QoSProfile

    name, message_class = graph.find('topic', topic)
    message = read_payload(text, message_class)
    ends = graph.node.get_subscriptions_info_by_topic(name)
    kept, profile = DurabilityPolicy.TRANSIENT_LOCAL, QoSProfile(depth=1)
    if any(each.qos_profile.durability == kept for each in ends):
        profile.durability = kept
    ros = graph.node.create_publisher(message_class, name, profile)
    try:
        graph.wait_for(lambda: ros.get_subscription_count() >= len(ends))
        ros.publish(message)
        # Else it would be gone before all have it; one that takes nothing holds nobody up.
        ros.wait_for_all_acked(Duration(seconds=_ANSWER_SEC))
    finally:
        graph.node.destroy_publisher(ros)
    return f'published, to {count_of(len(ends), "subscription")}'


def _render(message: Any) -> str:
    return render_yaml(plain_message(message))


def _range(descriptor: Any) -> list[float] | None:
    ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
    return [ranges[0].from_value, ranges[0].to_value] if ranges else None


def _describe_value(value: Any) -> dict[str, Any]:
    """Return a `value` as JSON has it, or the beginning of its text if it `is_cut`."""
    # Arrays and bytes are lists.
    text = json.dumps(value, default=list)
    is_cut = len(text) > _LONGEST_VALUE
    shown = f'{text[:_LONGEST_VALUE]}…' if is_cut else json.loads(text)
    return {'value': shown, 'is_cut': is_cut}
