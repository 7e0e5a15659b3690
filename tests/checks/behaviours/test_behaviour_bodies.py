"""What is wrong in the body of a behaviour is found in its line; idioms of rclpy are not."""

from pathlib import Path
from textwrap import indent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.reports.text import render_finding

IDIOMS = Path(__file__).parents[2] / 'data' / 'valid' / 'idioms'
SYSTEM = """
  rover:
    parameters: {speed: 1.0, mode: {default: slow, choices: [slow, fast]}}
    parameter_services: true
    state: {distance: 0.0}
    publishers:
      command: {type: geometry_msgs/msg/Twist, external: true}
      level: {type: std_msgs/msg/UInt8, external: true}
      scan: {type: sensor_msgs/msg/LaserScan, external: true}
      cover: {type: nav_msgs/msg/Odometry, external: true}
    subscriptions:
      odom: {type: nav_msgs/msg/Odometry, external: true, behaviour: parts:hear}
    service_clients: {enable: {type: std_srvs/srv/SetBool, external: true}}
    action_clients: {count: {type: test_msgs/action/Fibonacci, external: true}}
  camera:
    parameters: {gain: 0.5}
"""
# Uses all that the node has, so that nothing is unused.
USE_ALL = """
def use(node):
    node.publish('command', {})
    node.publish('level', 1)
    node.publish('scan', {})
    node.publish('cover', {})
    node.call('enable', True)
    node.send_goal('count', 3)
    return node.parameters.speed, node.parameters.mode
"""
HEAD = """
import functools
import math
from geometry_msgs.msg import Twist, Vector3
from sensor_msgs.msg import BatteryState, LaserScan


class Keeper:
    def __init__(self, node):
        self.node, self.publish = node, node.publish

    def go(self, payload):
        self.publish('command', payload)

    async def wait(self):
        return await self.node.call_async('enable', True)


def pass_on(node, name, payload):
    node.publish(name, payload)


def odometry(node):
    node.state.distance = 0.0
    return {'pose': {'pose': {'position': {'x': 1.0}}}}
"""
WRONG = {
    # names, however they are reached
    "if m.pose: node.publish('comand', {})": 'unknown-publisher',
    "ok = m.pose and node.publish('comand', {})": 'unknown-publisher',
    "n = node; n.publish('comand', {})": 'unknown-publisher',
    "send = node.publish; send('comand', {})": 'unknown-publisher',
    "getattr(node, 'publish')('comand', {})": 'unknown-publisher',
    "functools.partial(node.publish, 'comand')({})": 'unknown-publisher',
    "pass_on(node, 'comand', {})": 'unknown-publisher',
    "[node.publish(name, {}) for name in ('command', 'comand')]": 'unknown-publisher',
    "(lambda: node.publish('comand', {}))()": 'unknown-publisher',
    "node.call('enabel', True)": 'unknown-service-client',
    "node.send_goal('cuont', 1)": 'unknown-action-client',
    "print(node.parameters['sped'])": 'unknown-parameter',
    "print(node.parameters.get('sped', 1.0))": 'missing-parameter',
    "node.set_parameters('camera', {'gian': 1.0})": 'unknown-parameter',
    "node.set_parameters('camera', {'gain': 'high'})": 'refused-parameter',
    "node.set_parameters(node.name, {'mode': 'fsat'})": 'refused-parameter',
    "node.set_parameters('camrea', {'gain': 1.0})": 'unknown-node',
    'node.parameters.speed = 2.0': 'unset-parameter',
    'print(node.state.distanse)': 'unknown-state',
    "print(node.own_state['seen'])": 'unknown-state',
    'node.own_state.seen = 1': 'unknown-attribute',
    "node.pubish('command', {})": 'unknown-attribute',
    "node.logger.wran('late')": 'unknown-attribute',
    'print(node.now.nanoseconds)': 'unknown-attribute',
    "node.logger.info('%s', m)": 'bad-call',
    "node.publish('command')": 'bad-call',
    'Vector3(1.0, 2.0)': 'bad-call',
    'pass_on(node)': 'bad-call',
    # names, round by round
    "for i in range(2): node.publish(f'command{i}', {})": 'unknown-publisher',
    "for n in ('command', 'other'): node.publish(n, {})": 'unknown-publisher',
    "[node.publish(n, {}) for n in ('command', 'other') if n != 'command']": 'unknown-publisher',
    "node.call('enable' if m.child_frame_id else 'other', True)": 'unknown-service-client',
    "for n, value in {'command': {}, 'level': 256}.items(): pass_on(node, n, value)": 'field-range',
    "p = {n: 1.0 for n in ('x', 'w')}; node.publish('command', {'linear': p})": 'unknown-field',
    # what is read of messages
    'print(m.pose.pose.positon)': 'unknown-field',
    "print(node.call('enable', True).sucess)": 'unknown-field',
    "print(node.send_goal('count', 1).result().sequense)": 'unknown-field',
    "for f in node.send_goal('count', 1).feedback: print(f.sequense)": 'unknown-field',
    'print(BatteryState.POWER_SUPPLY_STATUS_FULLL)': 'unknown-field',
    "print(m['pose'])": 'unknown-field',
    # what is given away
    "node.publish('command', {'liner': {}})": 'unknown-field',
    "node.publish('command', {'linear': {'X': 1.0}})": 'unknown-field',
    "node.publish('command', Twist(linaer=Vector3()))": 'unknown-field',
    "t = Twist(); t.linear.X = 1.0; node.publish('command', t)": 'unknown-field',
    "p = {}; p['liner'] = 1; node.publish('command', p)": 'unknown-field',
    "Keeper(node).go({'liner': {}})": 'unknown-field',
    "node.publish('level', 'high')": 'field-type',
    "node.publish('level', 256)": 'field-range',
    "node.publish('level', m.pose.pose.position.x)": 'field-type',
    "node.publish('level', 'x' if m.pose else 1)": 'field-type',
    "node.publish('level', 3 / 2)": 'field-type',
    "node.publish('command', m)": 'field-type',
    "node.publish('scan', {'ranges': 1.0})": 'field-type',
    "node.publish('cover', {'pose': {'covariance': [0.0] * 9}})": 'field-length',
    "node.call('enable', 'yes')": 'field-type',
    # coroutines, and what has no effect
    'Keeper(node).wait()': 'missing-await',
    "node.call_async('enable', True)": 'missing-await',
    'm': 'no-effect',
    'print(mesage)': 'undefined-name',
    'while True: pass_on(node, "level", 1)': 'endless-loop',
}
RIGHT = [
    "for n, on in (('command', True), ('other', False)): node.publish(n, {}) if on else None",
    "for n in ('command', 'other'):\n    if m.child_frame_id == n: node.publish(n, {})",
    "for n in ('command', 'other'):\n    if n == 'other': continue\n    node.publish(n, {})",
    "n = 'command' if m.child_frame_id else 'other'\nif n != 'other': node.publish(n, {})",
    "node.publish('command', {'linear': {n: 1.0 for n in 'xyzw' if n != 'w'}})",
    "c = []\nfor n in range(36):\n    c.append(0.0)\nnode.publish('cover', {'pose': {'covariance': c}})",
    "if node.name == 'other': node.publish('comand', {})",
    "if hasattr(m, 'velocity'): print(m.velocity)",
    'try: print(m.velocity)\nexcept AttributeError: pass',
    "node.publish('level', int(m.pose.pose.position.x))",
    "node.publish('command', {'linear': {'x': 1}})",
    "p = {'a': 1} if m.child_frame_id else {}; print(p)",
    'if isinstance(m, Twist): print(m.linear)',
    "node.own_state['seen'] = node.own_state.get('seen', 0) + 1; print(node.own_state['seen'])",
    "if 'limit' in node.parameters: print(node.parameters.limit)",
    'print(BatteryState.POWER_SUPPLY_STATUS_FULL, LaserScan().ranges)',
    'setattr(node.state, m.child_frame_id, 1); print(node.state.anything)',
    "node.logger.info('late', throttle_duration_sec=1.0)",
    "node.publish('scan', {'ranges': map(float, range(3))})",
]


def check_line(check, line):
    body = indent(line, '    ')
    code = f'{HEAD}\n\ndef hear(node, m):\n    use(node)\n{body}\n{USE_ALL}'
    found = check(SYSTEM, code)
    return code.splitlines().index(body.splitlines()[0]) + 1, found


@pytest.mark.ros
@pytest.mark.parametrize(('line', 'rule'), WRONG.items(), ids=WRONG)
def test_what_is_wrong_is_found_in_its_line(check, line, rule):
    number, found = check_line(check, line)
    assert found == [(number, rule)]


@pytest.mark.ros
@pytest.mark.parametrize('line', RIGHT)
def test_what_may_be_right_has_no_finding(check, line):
    _, found = check_line(check, line)
    assert found == []


@pytest.mark.ros
@pytest.mark.parametrize(
    'folder', sorted(IDIOMS.glob('*/system.yaml')), ids=lambda p: p.parent.name
)
def test_an_idiom_has_no_finding(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    found = check_system(load_system(Path('system.yaml')), InterfaceCatalogue())
    assert [render_finding(each) for each in found] == []


def test_a_comment_in_python_silences_a_finding(check):
    code = f'{USE_ALL}\ndef hear(node, m):\n    use(node)\n    print(nobody)  # composer: ignore[undefined-name]\n'
    assert check(SYSTEM, code, installed=False) == []
    text = code.replace('print(nobody)', "print(nobody, '''\n").replace('name]\n', "name]''')\n")
    assert [rule for _, rule in check(SYSTEM, text, installed=False)] == ['undefined-name']
