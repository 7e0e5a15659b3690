"""A system with one of everything, and scenario files beside it."""

import textwrap
from pathlib import Path

import pytest

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.scenarios.checks import check_scenarios
from composer.scenarios.scenario_files import load_scenarios

INTERFACES = Path(__file__).parents[3] / 'interfaces' / 'action_tutorials_interfaces'
SYSTEM = f"""\
version: 1
interfaces: {{action_tutorials_interfaces: {INTERFACES}}}
nodes:
  robot:
    namespace: /lab
    parameters:
      limit: {{default: 1.0, minimum: 0.0}}
      mode: {{default: fast, choices: [fast, slow]}}
    subscriptions:
      scan: {{type: sensor_msgs/msg/LaserScan, topic: /scan, behaviour: moves:hear, external: true}}
    publishers:
      speed: {{type: geometry_msgs/msg/Twist, topic: /speed, external: true}}
    services:
      reset: {{type: std_srvs/srv/SetBool, service: /reset, behaviour: moves:reset}}
    service_clients:
      dock: {{type: std_srvs/srv/SetBool, service: /dock, external: true}}
    actions:
      count: {{type: action_tutorials_interfaces/action/Fibonacci, action: /count, behaviour: moves:count}}
    action_clients:
      drive: {{type: action_tutorials_interfaces/action/Fibonacci, action: /drive, external: true}}
    timers:
      tick: {{period: 1, behaviour: moves:tick}}
  driver:
    lifecycle: true
    on_activate: moves:activate
processes:
  camera:
    command: [sleep, '1']
    publishers:
      image: {{type: std_msgs/msg/String, topic: /image, external: true}}
"""
CODE = """\
def hear(node, message):
    node.publish('speed', {})

def reset(node, request):
    return {'success': True}

def count(node, goal):
    return {'sequence': [0] * goal.order}

def tick(node):
    node.call('dock', {'data': True})
    node.send_goal('drive', {'order': node.parameters.limit and 3})
    node.logger.info(node.parameters.mode)

def activate(node):
    node.logger.info('active')
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Return a folder with a system, which is the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text(SYSTEM)
    (tmp_path / 'moves.py').write_text(CODE)
    return tmp_path


@pytest.fixture
def check(project):
    """Return a function that checks the text of a scenario file beside the system."""
    path = project / 'a.scenario.yaml'

    def check(text):
        path.write_text(textwrap.dedent(text))
        loaded = load_scenarios(path.relative_to(project))
        return check_scenarios(loaded, InterfaceCatalogue())

    return check


@pytest.fixture
def check_case(check):
    """Return a function that checks a case, and returns the text, rule and message of findings."""

    def check_case(**parts):
        given, when, then = (parts.get(key, default) for key, default in DEFAULTS.items())
        text = (
            'version: 1\nsystem: {file: robot.yaml}\ncases:\n  one:\n    until: 10\n'
            f'    given: {given}\n    when: [{when}]\n    then: [{then}]\n'
        )
        found = check(text)
        return [
            f'{each.span.text} {each.rule}: {each.message}' + (f' ({each.help})' if each.help else '')
            for each in found
        ]  # fmt: skip

    return check_case


DEFAULTS = {'given': '{}', 'when': '', 'then': '{error: "*", never: true}'}
