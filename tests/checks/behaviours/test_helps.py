"""The help for behaviours that are not found."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

CODE = """\
from __future__ import annotations
from functools import partial
from typing import TYPE_CHECKING
from rclpy.node import Node
from other import imported

LIMIT = 3

class Thing: ...

def start(node): ...

def _hidden(node): ...
"""


@pytest.fixture
def advise(tmp_path, monkeypatch):
    """Return the help for a behaviour of an own project."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'pyproject.toml').touch()
    (tmp_path / 'other.py').write_text('def imported(node): ...\n')

    def advise(behaviour, **modules):
        for name, text in modules.items():
            path = tmp_path / f'{name.replace("__in__", "/")}.py'
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        path = tmp_path / 'rover.yaml'
        path.write_text(f'version: 1\nnodes: {{rover: {{on_start: "{behaviour}"}}}}\n')
        (finding,) = check_system(load_system(path), InterfaceCatalogue())
        return finding.help

    return advise


@pytest.mark.parametrize(
    ('name', 'code', 'advice'),
    [
        ('zzz', CODE, 'it has: start'),
        ('strt', CODE, "did you mean 'start'?"),
        ('importd', CODE, "did you mean 'imported'?"),
        ('node', 'from rclpy.node import Node', 'it has no functions'),
    ],
)
def test_only_what_can_be_called_is_suggested(advise, name, code, advice):
    assert advise(f'driving:{name}', driving=code) == advice


def test_a_package_that_hides_the_shipped_behaviours_is_named(advise):
    files = {'behaviours__in____init__': '', 'behaviours__in__own': 'def f(node): ...\n'}
    assert advise('behaviours.topics:drop', **files) == (
        'remove behaviours/__init__.py, which hides the other modules of this name'
    )
    assert advise('behaviours.owm:f', **files) == "did you mean 'behaviours.own'?"


SYSTEM = """
  a:
    parameters: {speed: 1.0}
    publishers: {out: {type: std_msgs/msg/String, external: true}}
    service_clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
    action_clients: {crane: {type: test_msgs/action/Fibonacci, external: true}}
    subscriptions: {heard: {type: std_msgs/msg/String, external: true, behaviour: parts:hear}}
    on_start: parts:C.run
"""
CLASS = """
from functools import partial
from std_msgs.msg import String
from std_srvs.srv import Trigger
def hear(node, message): print(message.data)
def alone(): pass
class C:
    def __init__(self, node): self.speed = node.parameters.sped
    def run(self, node):
        {}
        print(self.speed, node.parameters.speed, node.publish, node.send_goal, node.call)
    def tick(self, node): pass
    def back(self): pass
    def get(self, message): print(message.data)
    def got(node, message): print(message.data)
    def take(self, node, message, name=''): return {{}}
"""


@pytest.mark.parametrize(
    ('line', 'rule', 'helps'),
    [
        ('node.create_timer(1.0, self.tick)', 'bad-call', []),
        ('node.create_timer(1.0, self.back)', 'bad-call', ['add node after self']),
        ('node.create_timer(1.0, alone)', 'bad-call', ['add node first']),
        ('node.create_timer(1.0, lambda: 1)', 'bad-call', ['add node first']),
        ('node.create_timer(1.0, lambda n, m: 1)', 'bad-call', [None]),
        ("node.create_subscription(String, 'x', self.get)", 'bad-call', ['add node after self']),
        ("node.create_subscription(String, 'x', self.got)", 'bad-call', ['add self first']),
        ("node.create_subscription(String, 'x', self.tick)", 'bad-call', [None]),
        ("node.create_subscription(String, 'x', partial(self.take, nam=1))", 'bad-call', [None]),
        ("node.create_subscription(String, 'x', partial(self.take, name=1))", 'bad-call', []),
        ("node.create_service(Trigger, 'x', lambda request: {})", 'bad-call', ['add node first']),
        ("node.create_service(Trigger, 'x', self.take)", 'bad-call', []),
        ('node.create_timer(self.tick, 1 / 2)', 'bad-call', ['swap the arguments']),
        ("node.create_publisher(f'{node.name}', String)", 'bad-call', ['swap the arguments']),
        ("node.create_service(Trigger, hear, 'x')", 'bad-call', ['swap the arguments']),
        ('node.create_publisher(String, node.name)', 'bad-call', []),
        (
            "node.call('crane')",
            'unknown-service-client',
            ['it is an action client: use node.send_goal'],
        ),
        ("node.publish('ask', 1)", 'unknown-publisher', ['it is a service client: use node.call']),
        ("node.publish('heard', 1)", 'unknown-publisher', ['it is a subscription']),
        ("node.call('crane')", 'unused-action-client', []),
        (
            "node.set_parameters(node.name, {'spee': 1.0})",
            'unknown-parameter',
            ["did you mean 'speed'?"] * 2,
        ),
        ('print(self.speed)', 'unknown-parameter', ["did you mean 'speed'?"]),
        ("node.set_parameters(node.name, {'speed': 'a'})", 'refused-parameter', [None]),
    ],
)
def test_the_right_method_and_arguments_are_named(check, line, rule, helps):
    assert check(SYSTEM, CLASS.format(line), rule=rule, tells='help') == helps


@pytest.mark.parametrize(
    ('behaviour', 'advice'),
    [
        ('C.get', 'add node after self'),
        ('C.got', 'add self first'),
        ('alone', 'add node first'),
        ('C.back', 'add node after self'),
        ('C.tick', None),
    ],
)
def test_the_parameter_that_was_forgotten_is_named(check, behaviour, advice):
    system = SYSTEM.replace('parts:hear', f'parts:{behaviour}')
    found = check(system, CLASS.format('pass'), rule='bad-signature', tells='help')
    assert found == [advice]


@pytest.mark.parametrize(
    ('code', 'rules'),
    [
        ('def on_start(self, state): open(node)', ['undefined-name']),
        ('def on_start(self, state): open(node)\n    def x(self, node): 1', ['undefined-name']),
        ('def on_start(self, node): (lambda: (lambda: open(node))())()', []),
        ('def on_start(self, node, state): pass', ['bad-signature']),
        ('def on_start(self, node): pass', ['unused-parameter', 'unused-publisher']),
    ],
)
def test_without_its_node_nothing_of_it_is_called_unused(check, code, rules):
    system = ''.join(SYSTEM.splitlines(keepends=True)[:4]) + '    on_start: parts:C.on_start\n'
    assert [rule for _, rule in check(system, f'class C:\n    {code}\n')] == rules
