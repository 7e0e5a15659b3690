"""`composer echo`, `call`, `send-goal` and `set`: the values of what runs on the ROS graph."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from composer.application.running_systems.client import Client
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.plain_messages import plain_message
from composer.names import count_of
from composer.runtime.messages.payload_texts import read_parameter, read_payload
from composer.signals import asked_to_stop
from composer.spelling import suggest
from composer.yaml_text.writer import COMPOSER, render_scalar, render_yaml

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node
    from rclpy.task import Future

_POLL_SEC = 0.05
# The rate is told so often.
_REPORT_SEC = 1.0
_COMPLETION_SEC = 0.7
# An array is one line.
_DIALECT = replace(COMPOSER, has_expressions=False, widest_line=math.inf)
_FIELD = re.compile(r'(\w+|\[\d+\])(\.\w+|\[\d+\])*')
_STEP = re.compile(r'\w+')
_SUCCEEDED = 4
_STATUSES = {5: 'canceled', 6: 'aborted'}


class _Graph:
    """The ROS graph, as long as nobody asks to stop and until the time is over."""

    def __init__(self, client: Client, is_asked: Callable[[], bool], timeout_sec: float) -> None:
        self.node: Node = client.node
        self.is_asked = is_asked
        self.timeout_sec = timeout_sec
        self._executor = client.executor

    def spin(self) -> None:
        """Let something happen."""
        self._executor.spin_once(timeout_sec=_POLL_SEC)

    def wait_for(self, condition: Callable[[], Any], *, is_endless: bool = False) -> Any:
        """Return the first true result of a condition; the last one if time is over."""
        deadline = monotonic() + self.timeout_sec
        while not (found := condition()) and not self.is_asked():
            if monotonic() > deadline and not is_endless:
                break
            self.spin()
        return found

    def result(self, future: Future, missing: str, *, is_endless: bool = False) -> Any:
        """Return what a future brings.

        Raises:
            ComposerError: It did not come in time.
        """
        if not self.wait_for(future.done, is_endless=is_endless):
            message = missing if not self.is_asked() else 'interrupted'
            raise ComposerError(message)
        return future.result()

    def names(self, kind: str) -> dict[str, list[str]]:
        """Return the full names of all of a kind, each with its types; a node has none."""
        if kind == 'action':
            from rclpy.action import get_action_names_and_types

            return dict(get_action_names_and_types(self.node))
        if kind == 'node':
            pairs = self.node.get_node_names_and_namespaces()
            return {f'{namespace.rstrip("/")}/{name}': [] for name, namespace in pairs}
        return dict(getattr(self.node, f'get_{kind}_names_and_types')())

    def find(self, kind: str, name: str) -> tuple[str, str]:
        """Return the full name and the type of a topic, a service or an action.

        Raises:
            ComposerError: There is none, or it has several types.
        """
        name = f'/{name.lstrip("/")}'

        types: list[str] = self.wait_for(lambda: self.names(kind).get(name)) or []
        if len(types) == 1:
            return name, types[0]
        if types:
            message = f"the {kind} '{name}' has several types: {', '.join(types)}"
            raise ComposerError(message)
        raise self.missing(kind, name)

    def missing(self, kind: str, name: str) -> ComposerError:
        """Return the error for what was not found."""
        if self.is_asked():
            return ComposerError('interrupted')
        message = f"there is no {kind} '{name}' on this ROS graph"
        return ComposerError(message, help=suggest(name, self.names(kind), 'there are'))


def list_names(kind: str) -> list[str]:
    """Return the names of all of a kind that are found soon, for the completion of a shell."""
    with suppress(ComposerError), Client() as client:
        graph = _Graph(client, lambda: False, _COMPLETION_SEC)
        graph.wait_for(lambda: False)
        return sorted(graph.names(kind))
    return []


def echo(topic: str, field: str, *, once: bool, tells_rate: bool, timeout_sec: float) -> int:
    """Print the messages of a topic until a signal comes; return the exit code.

    Args:
        field: Which part of them, as in `pose.position.x` or `ranges[0]`; all if it is empty.
        once: Whether the first one is enough; it must come in time.
        tells_rate: Whether to print how many come in a second, in place of them.
        timeout_sec: How long the topic may take to be found.

    Raises:
        ComposerError: There is no such topic or field, or no message came.
    """
    if field and not _FIELD.fullmatch(field):
        message = f"'{field}' is no field: write it as in pose.position.x, or ranges[0]"
        raise UsageError(message)
    with asked_to_stop() as is_asked, Client() as client:
        from composer.recordings.definitions import import_message
        from composer.recordings.graph_recorder import match_offers, read_offer

        graph = _Graph(client, is_asked, timeout_sec)
        name, type_name = graph.find('topic', topic)
        message_class = import_message(type_name)
        _pick(message_class(), field, is_checked=True)
        # All publishers are there a moment after the topic.
        graph.spin()
        ends = graph.node.get_publishers_info_by_topic(name)
        profile = match_offers(read_offer(each.qos_profile) for each in ends)
        times: list[float] = []

        def take(message: Any) -> None:
            times.append(monotonic())
            if not tells_rate:
                _show(_pick(message, field), is_document=not field)

        told = monotonic()
        graph.node.create_subscription(message_class, name, take, profile)
        if once and not graph.wait_for(lambda: times):
            message = f"no message of '{name}' came within {timeout_sec:g} s"
            raise ComposerError(message, help=None if ends else 'nobody publishes it')
        while not (once or is_asked()):
            graph.spin()
            if (now := monotonic()) - told >= _REPORT_SEC:
                if tells_rate:
                    _tell_rate(times)
                told = now
                del times[:-1]
    return ExitCode.DONE


def _tell_rate(times: list[float]) -> None:
    """Print how often messages have come at these times."""
    periods = [after - before for before, after in pairwise(times)]
    if not periods:
        click.echo('no message')
        return
    apart = f'{min(periods):.4f} to {max(periods):.4f} s apart'
    rate = len(periods) / sum(periods)
    click.echo(f'{rate:.2f} Hz: {count_of(len(periods), "message")}, {apart}')


def call(service: str, payload: str, timeout_sec: float) -> int:
    """Call a service, print its answer, and return the exit code.

    Raises:
        ComposerError: There is no such service, the payload does not fit, or no answer came.
    """
    with asked_to_stop() as is_asked, Client() as client:
        from composer.interfaces.classes import import_interface

        graph = _Graph(client, is_asked, timeout_sec)
        name, type_name = graph.find('service', service)
        service_class: Any = import_interface(type_name)
        request = read_payload(payload, service_class.Request)
        _show(_call(graph, name, service_class, request))
    return ExitCode.DONE


def _call(graph: _Graph, name: str, service_class: Any, request: Any) -> Any:
    ros = graph.node.create_client(service_class, name)
    silent = f"the service '{name}' did not answer within {graph.timeout_sec:g} s"
    if not graph.wait_for(ros.service_is_ready):
        raise ComposerError(silent)
    return graph.result(ros.call_async(request), silent)


def send_goal(action: str, payload: str, timeout_sec: float) -> int:
    """Send a goal, print its feedback and result, and return the exit code: 1 if it fails.

    A signal cancels it.

    Raises:
        ComposerError: There is no such action, the payload does not fit, or the goal is refused.
    """
    with asked_to_stop() as is_asked, Client() as client:
        from rclpy.action import ActionClient

        from composer.interfaces.classes import import_interface

        graph = _Graph(client, is_asked, timeout_sec)
        name, type_name = graph.find('action', action)
        action_class: Any = import_interface(type_name)
        goal = read_payload(payload, action_class.Goal)
        ros = ActionClient(graph.node, action_class, name)
        try:
            silent = f"the action '{name}' did not answer within {timeout_sec:g} s"
            if not graph.wait_for(ros.server_is_ready):
                raise ComposerError(silent)
            sent = ros.send_goal_async(goal, lambda message: _show(message.feedback))
            return _follow(graph, graph.result(sent, silent), silent, name)
        finally:
            ros.destroy()


def _follow(graph: _Graph, handle: Any, silent: str, name: str) -> int:
    if not handle.accepted:
        message = f"the action '{name}' has refused the goal"
        raise ComposerError(message)
    future = handle.get_result_async()
    graph.wait_for(future.done, is_endless=True)
    if not future.done():
        click.echo('canceling the goal', err=True)
        graph.is_asked = lambda: False
        handle.cancel_goal_async()
    found = graph.result(future, silent)
    _show(found.result)
    if found.status != _SUCCEEDED:
        click.echo(f'the goal was {_STATUSES.get(found.status, "lost")}', err=True)
    return ExitCode.DONE if found.status == _SUCCEEDED else ExitCode.FAILED


def set_parameter(node: str, name: str, text: str, timeout_sec: float) -> int:
    """Set a parameter of a node, and return the exit code.

    Args:
        node: Its full name, or what follows the last slash of it.

    Raises:
        ComposerError: There is no such node or parameter, or the node refuses the value.
    """
    with asked_to_stop() as is_asked, Client() as client:
        from rcl_interfaces.srv import GetParameterTypes, ListParameters, SetParameters

        graph = _Graph(client, is_asked, timeout_sec)
        full_name = _find_node(graph, node)
        asked = GetParameterTypes.Request(names=[name])
        types = _call(graph, f'{full_name}/get_parameter_types', GetParameterTypes, asked).types
        if not any(types):
            listed = ListParameters.Request()
            names = _call(graph, f'{full_name}/list_parameters', ListParameters, listed)
            message = f"'{full_name}' has no parameter '{name}'"
            raise ComposerError(message, help=suggest(name, names.result.names, 'it has'))
        parameter = read_parameter(name, text, types[0])
        request = SetParameters.Request(parameters=[parameter])
        [result] = _call(graph, f'{full_name}/set_parameters', SetParameters, request).results
        if not result.successful:
            message = (
                f"'{full_name}' refuses {name} = {text}: {result.reason or 'without a reason'}"
            )
            raise ComposerError(message)
    return ExitCode.DONE


def _find_node(graph: _Graph, node: str) -> str:
    def meant() -> list[str]:
        return [each for each in graph.names('node') if node in (each, each.rpartition('/')[2])]

    found: list[str] = graph.wait_for(meant)
    if len(found) == 1:
        return found[0]
    if found:
        message = f"several nodes have the name '{node}': {', '.join(found)}"
        raise ComposerError(message, help='write the full name of one')
    kind = 'node'
    raise graph.missing(kind, node)


def _pick(message: Any, field: str, *, is_checked: bool = False) -> Any:
    """Return a part of a message, checked only: as far as fields have names."""
    value = message
    for step in _STEP.findall(field):
        if hasattr(value, 'get_fields_and_field_types') and not step.isdigit():
            names = value.get_fields_and_field_types()
            if step not in names:
                text = f"'{type(value).__name__}' has no field '{step}'"
                raise ComposerError(text, help=suggest(step, names, 'it has'))
            value = getattr(value, step)
            continue
        with suppress(TypeError, IndexError, ValueError, KeyError):
            value = value[int(step)]
            continue
        if is_checked:
            return None
        text = f"a message has no '{field}'"
        raise ComposerError(text)
    return value


def _show(value: Any, *, is_document: bool = True) -> None:
    """Print a message, or a part of one."""
    data = plain_message(value)
    if isinstance(data, dict | list) and data:
        click.echo(render_yaml(data, _DIALECT), nl=False)
    else:
        click.echo(render_scalar(data, _DIALECT) if data != {} else '{}')
    if is_document:
        click.echo('---')
