"""`composer echo`, `call`, `send-goal` and `set`: the values of what runs on the ROS graph."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from time import monotonic
from typing import Any

import click

from composer.application.running_systems.client import Client
from composer.application.running_systems.live_graph import LiveGraph
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.plain_messages import plain_message
from composer.names import count_of
from composer.runtime.messages.payload_texts import read_payload
from composer.signals import asked_to_stop
from composer.spelling import suggest
from composer.yaml_text.writer import COMPOSER, render_scalar, render_yaml

# The rate is told so often.
_REPORT_SEC = 1.0
_COMPLETION_SEC = 0.7
# An array is one line.
_DIALECT = replace(COMPOSER, has_expressions=False, widest_line=math.inf)
_FIELD = re.compile(r'(\w+|\[\d+\])(\.\w+|\[\d+\])*')
_STEP = re.compile(r'\w+')
_SUCCEEDED = 4
_STATUSES = {5: 'canceled', 6: 'aborted'}


def list_names(kind: str) -> list[str]:
    """Return the names of all of a kind that are found soon, for the completion of a shell."""
    with suppress(ComposerError), Client() as client:
        graph = LiveGraph(client, _COMPLETION_SEC)
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
        graph = LiveGraph(client, timeout_sec, is_asked)
        name, message_class = graph.find('topic', topic)
        _pick(message_class(), field, is_checked=True)
        # All publishers are there a moment after the topic.
        graph.spin()
        times: list[float] = []

        def take(message: Any) -> None:
            times.append(monotonic())
            if not tells_rate:
                _show(_pick(message, field), is_document=not field)

        told = monotonic()
        graph.subscribe(name, message_class, take)
        if once and not graph.wait_for(lambda: times):
            message = f"no message of '{name}' came within {timeout_sec:g} s"
            is_published = graph.node.count_publishers(name)
            raise ComposerError(message, help=None if is_published else 'nobody publishes it')
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
        graph = LiveGraph(client, timeout_sec, is_asked)
        name, service_class = graph.find('service', service)
        _show(graph.call(name, service_class, read_payload(payload, service_class.Request)))
    return ExitCode.DONE


def send_goal(action: str, payload: str, timeout_sec: float) -> int:
    """Send a goal, print its feedback and result, and return the exit code: 1 if it fails.

    A signal cancels it.

    Raises:
        ComposerError: There is no such action, the payload does not fit, or the goal is refused.
    """
    with asked_to_stop() as is_asked, Client() as client:
        from rclpy.action import ActionClient

        graph = LiveGraph(client, timeout_sec, is_asked)
        name, action_class = graph.find('action', action)
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


def _follow(graph: LiveGraph, handle: Any, silent: str, name: str) -> int:
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
    """Set a parameter of a node, and return the exit code; see `LiveGraph.set_parameter`."""
    with asked_to_stop() as is_asked, Client() as client:
        LiveGraph(client, timeout_sec, is_asked).set_parameter(node, name, text)
    return ExitCode.DONE


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
