"""Annotations against what behaviours are wired to: wrong ones are found, odd ones let pass."""

import pytest

IMPORTS = """\
from __future__ import annotations
from typing import Any, Generator, Iterator, Optional, TypeVar, Union, TYPE_CHECKING
import std_msgs.msg
import std_msgs.msg as messages
import geometry_msgs
from composer import Node
if TYPE_CHECKING:
    from elsewhere import Strange
from std_msgs import msg
from std_msgs.msg import Float64, Int32, String
from std_msgs.msg import String as Text
from std_msgs.msg._string import String as Inner
from std_srvs.srv import SetBool, SetBool_Request, Trigger
from geometry_msgs.msg import Point, Twist, Vector3
try:
    from std_msgs.msg import Bool
except ImportError:
    Bool = None
T = TypeVar('T')
"""
LISTENER = """
  a:
    subscriptions: {in: {type: std_msgs/msg/String, external: true, behaviour: parts:hear}}
"""


@pytest.mark.parametrize(
    'annotation',
    [
        'String',
        'Inner',
        'messages.String',
        "'String'",
        "'not python'",
        'Strange',
        'T',
        'Optional[Int32]',
        'Union[Int32, String]',
        'Unknown',
        'Int32.data',
    ],
)
def test_a_right_annotation_passes_and_so_does_what_cannot_be_told(check, annotation):
    code = IMPORTS + f'def hear(node: Node, message: {annotation}): ...\n'
    assert check(LISTENER, code) == []


@pytest.mark.parametrize(
    ('annotation', 'shown'),
    [
        ('Int32', 'std_msgs/msg/Int32'),
        ("'Int32'", 'std_msgs/msg/Int32'),
        ('SetBool.Request', 'std_srvs/srv/SetBool.Request'),
        ('SetBool', 'std_srvs/srv/SetBool'),
        ('str', 'str'),
        ('dict[str, str]', 'dict'),
    ],
)
def test_an_annotation_of_another_type_is_a_finding(check, annotation, shown):
    code = IMPORTS + f'def hear(node: Node, message: {annotation}): ...\n'
    assert check(LISTENER, code, rule='wrong-annotation') == [
        f"'hear' takes a {shown} as 'message', and is given a std_msgs/msg/String"
    ]


def test_the_node_comes_first(check):
    code = IMPORTS + 'def hear(message: String, node: Node): ...\n'
    assert check(LISTENER, code, rule='wrong-annotation') == [
        "'hear' takes a std_msgs/msg/String as 'message', and is given the node first"
    ]


SERVER = """
  a:
    services: {set_it: {type: std_srvs/srv/SetBool, behaviour: parts:serve}}
"""


@pytest.mark.parametrize(
    ('annotations', 'findings'),
    [
        ('request: SetBool.Request) -> SetBool.Response', 0),
        ('request: SetBool.Request) -> tuple[bool, str]', 0),
        ('request: SetBool.Response) -> None', 1),
        pytest.param('request) -> SetBool.Request', 1, marks=pytest.mark.ros),
    ],
)
def test_a_service_is_annotated_with_its_parts(check, annotations, findings):
    code = IMPORTS + f'def serve(node, {annotations}: ...\n'
    assert len(check(SERVER, code, rule='wrong-annotation')) == findings


@pytest.mark.ros
@pytest.mark.parametrize(
    ('published', 'annotation', 'is_right'),
    [
        ('std_msgs/msg/String', 'str', True),
        ('std_msgs/msg/String', 'String', True),
        ('std_msgs/msg/String', 'None', True),
        ('std_msgs/msg/String', 'Int32', False),
        ('geometry_msgs/msg/Twist', 'Twist', True),
        ('geometry_msgs/msg/Polygon', 'list', True),
    ],
)
def test_what_is_returned_makes_the_message(check, published, annotation, is_right):
    nodes = f"""
  a:
    publishers: {{out: {{type: {published}, external: true}}}}
    timers: {{tick: {{period: 1, behaviour: parts:tick, publish: out}}}}
"""
    code = IMPORTS + f'def tick(node: Node) -> {annotation}: ...\n'
    assert (check(nodes, code) == []) == is_right


@pytest.mark.ros
def test_an_action_is_annotated_with_its_parts(check):
    nodes = """
  a:
    actions: {do: {type: test_msgs/action/Fibonacci, behaviour: parts:do, accept: parts:take}}
    action_clients: {do: {type: test_msgs/action/Fibonacci, feedback: parts:feel, result: parts:end}}
    timers: {tick: {period: 1, behaviour: parts:send}}
"""
    code = """
        from collections.abc import Generator
        from test_msgs.action import Fibonacci

        def do(node, goal: Fibonacci.{}) -> Generator[list[int], None, Fibonacci.Result]:
            yield
            return Fibonacci.Result()

        def take(node, goal: Fibonacci.{}): ...
        def feel(node, feedback: Fibonacci.{}): ...
        def end(node, result: Fibonacci.Result): ...
        def send(node): node.send_goal('do')
    """
    right = code.format('Goal', 'Goal', 'Feedback')
    assert check(nodes, right) == []
    wrong = code.format('Result', 'Feedback', 'Result')
    assert len(check(nodes, wrong, rule='wrong-annotation')) == 3
