"""What is wrong in the body of a behaviour is found in its line; idioms of rclpy are not."""

from textwrap import indent

import pytest

SYSTEM = """
  rover:
    parameters:
      speed: 1.0
      mode: {default: slow, choices: [slow, fast]}
      unset: {type: integer}
      names: [a, b]
      gains: [1.0, 2.0]
    parameter_services: true
    state: {distance: 0.0}
    publishers:
      command: {type: geometry_msgs/msg/Twist, external: true}
      level: {type: std_msgs/msg/UInt8, external: true}
      scan: {type: sensor_msgs/msg/LaserScan, external: true}
      cover: {type: nav_msgs/msg/Odometry, external: true}
    subscriptions:
      odom: {type: nav_msgs/msg/Odometry, external: true, behaviour: parts:hear}
    service_clients:
      enable: {type: std_srvs/srv/SetBool, external: true}
      plan: {type: nav_msgs/srv/GetPlan, external: true}
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
    node.call('plan', {})
    node.send_goal('count', 3)
    return (
        *(node.parameters.speed, node.parameters.mode, node.parameters.unset),
        *(node.parameters.names, node.parameters.gains),
    )
"""
HEAD = """
import asyncio
import threading
from collections import Counter, OrderedDict, defaultdict, deque, namedtuple
from types import SimpleNamespace
import copy
import dataclasses
import datetime
import enum
import functools
import itertools
import json
import math
import pathlib
import random
import re
import rclpy.duration
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState, LaserScan


class Keeper:
    def __init__(self, node):
        self.node, self.publish = node, node.publish

    def go(self, payload):
        self.publish('command', payload)

    async def __aenter__(self):
        return self

    async def __aexit__(self, *reason):
        return None

    async def wait(self):
        return await self.node.call_async('enable', True)


@dataclasses.dataclass
class Turn:
    linear: dict
    angul: dict  # of VARS


class Gear(enum.IntEnum):
    LOW = 1
    HIGH = 2


def nested(depth):
    if depth:
        return nested(depth - 1)
    return {'angul': {}}  # of NESTED


def poses(node):
    return node.call('plan', {}).plan.poses


def fill(gains):
    getattr(gains, 'update')({'d': 0.1})


def pass_on(node, name, payload):
    node.publish(name, payload)


async def run_beside(node):
    await asyncio.sleep(1)
    await asyncio.gather(asyncio.sleep(1), asyncio.sleep(2))


def odometry(node):
    node.state.distance = 0.0
    return {'pose': {'pose': {'position': {'x': 1.0}}}}
"""
WRONG = {
    # what classes and dictionaries of the project have not
    "print(node.state['distance'])": 'unknown-attribute',
    "node.state['distance'] = 1.0": 'unknown-attribute',
    "if m.pose: node.publish('comand', {})": 'unknown-publisher',
    "n = node; n.publish('comand', {})": 'unknown-publisher',
    "send = node.publish; send('comand', {})": 'unknown-publisher',
    "pass_on(node, 'comand', {})": 'unknown-publisher',
    "node.call('enabel', True)": 'unknown-service-client',
    "node.send_goal('cuont', 1)": 'unknown-action-client',
    "print(node.parameters['sped'])": 'unknown-parameter',
    "node.set_parameters('camera', {'gian': 1.0})": 'unknown-parameter',
    "node.set_parameters('camera', {'gain': 'high'})": 'refused-parameter',
    "node.set_parameters('camrea', {'gain': 1.0})": 'unknown-node',
    'node.parameters.speed = 2.0': 'unset-parameter',
    'print(node.state.distanse)': 'unknown-state',
    "print(node.own_state['seen'])": 'unknown-state',
    'node.own_state.seen = 1': 'unknown-attribute',
    "node.pubish('command', {})": 'unknown-attribute',
    "node.logger.wran('late')": 'unknown-attribute',
    "node.publish('command')": 'bad-call',
    'pass_on(node)': 'bad-call',
    # names, round by round
    'print(m.pose.pose.positon)': 'unknown-field',
    'print(BatteryState.POWER_SUPPLY_STATUS_FULLL)': 'unknown-field',
    "node.publish('command', {'liner': {}})": 'unknown-field',
    "t = Twist(); t.linear.X = 1.0; node.publish('command', t)": 'unknown-field',
    "node.publish('level', 'high')": 'field-type',
    # values that Python, or rclpy, does not take
    "node.create_timer('1.0', use)": 'bad-call',
    "node.create_publisher('std_msgs/msg/Strin', 'made')": 'unknown-type',
    "node.create_client('std_srvs/msg/SetBool', 'made')": 'unknown-type',
    "node.publish('level', node.parameters.unset)": 'no-value',
    'print(node.parameters.unset * 2)': 'no-value',
    'print(1 < node.parameters.unset < 2)': 'no-value',
    'print(node.parameters.unset[0])': 'no-value',
    'print(len(node.parameters.unset))': 'no-value',
    'print(min(2, node.parameters.unset))': 'no-value',
    'u = node.parameters.unset; print(1 if abs(m.pose.pose.position.x) > u else 2)': 'no-value',
    'if math.sqrt(node.parameters.unset) > 2: print()': 'no-value',
    'x = 1; x *= node.parameters.unset': 'no-value',
    "print(f'{node.parameters.unset:04d}')": 'no-value',
    'm.pose.pose.position.x = node.parameters.unset': 'no-value',
    'one, two = node.parameters.unset': 'no-value',
    'for each in node.parameters.unset: print(each)': 'no-value',
    'print(m.pose.covariance[36])': 'bad-index',
    'kept = m.pose.covariance[36]; print(kept, kept)': 'bad-index',
    "node.publish('scan', {'ranges': [m.pose.pose.position.x, 'x']})": 'field-type',
    "node.publish('scan', {'ranges': [*m.pose.covariance, 'x' if m.pose else 1.0]})": 'field-type',
    "node.publish('level', 256)": 'field-range',
    "node.publish('cover', {'pose': {'covariance': [0.0] * 6}})": 'field-length',
    "node.publish('level', 'x' if m.pose else 1)": 'field-type',
    "node.publish('scan', {'ranges': 1.0})": 'field-type',
    "def give(node): return {'lat': 1.0}\nnode.create_timer(1.0, give, publish='command')": 'unknown-field',
    # payloads that are computed
    'for each in Path(poses=[]).poses: each.pose.x = 1.0': 'unknown-field',
    'Keeper(node).wait()': 'missing-await',
    "node.call_async('enable', True)": 'missing-await',
    "await node.publish('command', {})": 'missing-await',
    'await asyncio.sleep(m.pose.pose.position.x)': 'no-event-loop',
    "await asyncio.gather(node.call_async('enable', True))": 'no-event-loop',
    'node.shutdown': 'no-effect',
    "threading.Thread(target=pass_on, args=(node, 'level', 1))": 'no-effect',
    'if node.parameters.speed > 1: node.parameters.speed = 1.0': 'unset-parameter',
    'print(mesage)': 'undefined-name',
    "try: node.publish('command', {'lat': 1.0})\nexcept Exception: print()": 'unknown-field',
    'while True: pass_on(node, "level", 1)': 'endless-loop',
    # wrong in any system, whatever the file says
    "if node.parameters.mode == 'fast': await node.call('enable', True)": 'missing-await',
    'if node.parameters.speed > 2: t = Twist(); t.speed = 1.0': 'unknown-field',
    "if node.parameters.speed > 2: node.publish('command', Twist(speed=1.0))": 'unknown-field',
}
RIGHT = [
    "from composer import PayloadError\ntry: node.publish('command', {'lat': 1.0})\nexcept PayloadError: print()",
    'print(Turn(linear={}, angul={}).angul)',
    'keeper = Keeper(node); setattr(keeper, m.child_frame_id, 1); print(keeper.speed)',
    "gains = {'p': 1.0}; gains['d'] = 0.1; print(gains['d'])",
    "gains = defaultdict(float, p=1.0); print(gains['d'])",
    "try:\n    print({'p': 1.0}['d'])\nexcept KeyError:\n    pass",
    'found = re.match("a", m.child_frame_id)\nif found: print(found.group(1) + "x")',
    't = Twist(); t.linear.x = 1.0; t.linear.y = float(m.child_frame_id)',
    'a, b = node.parameters.gains\nfor each in node.parameters.names: print(each.strip())',
    'if isinstance(node.parameters.gains, list) or hasattr(node.parameters.gains, "x"): print()',
    "node.publish('scan', {'ranges': node.parameters.gains + [1.0]})",
    "node.publish(f'com{m.child_frame_id}', {})",
    "node.create_publisher(Twist, 'comand_x'); node.publish(f'comand_{m.child_frame_id}', {})",
    "print(node.parameters[f'use_{m.child_frame_id}'])",
    "print('comand_' + m.child_frame_id)",
    'if type(m).__module__ == node.parameters.mode: print(m.velocity)',
    "kept = node.own_state.setdefault('kept', []); kept.append(m); print(kept[0].velocity)",
    'try: print(m.pose.pose.position)\nexcept AttributeError: print(m.pose.position, m.position)',
    'path = Path(); path.poses.append(poses(node)[0])',
    "node.set_parameters('camera', dict(gain=2.0))",
    "if node.parameters.mode == 'fast': print(m.velocity)",
    'if node.parameters.speed > 2: print(m.velocity)',
    "for n, on in (('command', True), ('other', False)): node.publish(n, {}) if on else None",
    "node.publish('command', {'linear': {n: 1.0 for n in 'xyzw' if n != 'w'}})",
    "node.publish('cover', {'pose': {'covariance': [0.0] * 36}})",
    "if node.name == 'other': node.publish('comand', {})",
    "if hasattr(m, 'velocity'): print(m.velocity)",
    'try: print(m.velocity)\nexcept AttributeError: pass',
    "node.publish('level', int(m.pose.pose.position.x))",
    'if isinstance(m, Twist): print(m.linear)',
    "node.own_state['seen'] = node.own_state.get('seen', 0) + 1; print(node.own_state['seen'])",
    "if 'limit' in node.parameters: print(node.parameters.limit)",
    'setattr(node.state, m.child_frame_id, 1); print(node.state.anything)',
    "kept = node.call_async('enable', True); await kept",
    'await asyncio.sleep(0)',
    'threading.Thread(target=lambda: asyncio.run(run_beside(node))).start()',
    "thread = threading.Thread(target=functools.partial(pass_on, node, 'level', 1)); thread.start()",
    'async with Keeper(node): pass',
    "node.publish('level', node.parameters.unset or 1)",
    "u = node.parameters.unset\nif u and u > 2: print(f'{u:04d}')",
    "u = node.parameters.unset\nprint(f'{u} {u!r:>9}', round(1.5, u), max([1], default=u), '%s' % u)",
    'print(max(node.parameters.unset, 1, key=lambda each: each or 0))',
    "if node.parameters.unset is not None: node.publish('level', node.parameters.unset)",
    "n = node.parameters.unset\nif n is None: n = 1\nnode.publish('level', n)",
    "node.create_publisher(node.parameters.mode, 'made'); node.publish('made', {'x': 1})",
    'stop = node.shutdown; print(stop)',
    "names = ['comand', 'command']; del names[0]; node.publish(names[0], {})",
    "for i in range(3):\n    if i == m.twist.twist.linear.x: break\nelse: node.publish('never', 1)",
    "by = {'a': m}; by[m.child_frame_id] = Twist(); print(by['b'].linear, by['a'].linear)",
    'q = deque([m], maxlen=3); q.appendleft(m); q.rotate(); print(q.pop().pose, tuple([m]).count(m))',
    's = set(); s.add(1); s.update([2]); s.discard(1); print(s.pop() + 1, frozenset(s).union(s))',
    "c = Counter('abc'); c.update('d'); print(c.most_common(1)[0][0], c['a'] + 1, c.total())",
    "d = defaultdict(list); d['a'].append(m); print(d['a'][0].pose, d.default_factory)",
    'i = iter([1, 2]); next(i); print(next(i), list(i), i.__next__)',
    "print((5).real, (5.5).is_integer(), (5).to_bytes(2, 'big').hex(), 'a'.encode().decode().upper())",
    "t = Twist(); t.linear = {'x': 1.0}; node.publish('command', t)",
    "def give(node): return {'lat': 1.0}\nnode.create_timer(1.0, give, publish=node.parameters.mode)",
    "def give(node): return None if m.pose else 5\nnode.create_timer(1.0, give, publish='level')",
]


def check_line(check, line):
    body = indent(line, '    ')
    kind = 'async def' if 'await ' in line or 'async ' in line else 'def'
    code = f'{HEAD}\n\n{kind} hear(node, m):\n    use(node)\n{body}\n{USE_ALL}'
    found = check(SYSTEM, code)
    return code.splitlines().index(body.splitlines()[0]) + 1, found


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize(('line', 'rule'), WRONG.items(), ids=WRONG)
def test_what_is_wrong_is_found_in_its_line(check, line, rule):
    number, found = check_line(check, line)
    assert found == [(number, rule)]


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize('line', RIGHT)
def test_what_may_be_right_has_no_finding(check, line):
    _, found = check_line(check, line)
    assert found == []


@pytest.mark.ros
def test_a_wrong_name_is_found_once_where_it_is_written(check):
    body = 'def show(it): print(it.x)\ndef hear(node, m):\n    use(node)\n    kept = m.pose.position\n'
    code = f'{HEAD}{body}    kept.x = 1.0\n    print(m.pose.positio.y)\n    show(kept)\n{USE_ALL}'
    first, second = check(SYSTEM, code, rule='unknown-field', tells='span')
    assert (first.text, second.text) == ('position', 'positio')
    helped = check(SYSTEM, code, rule='unknown-field', tells='help')
    assert helped[0] == "did you mean 'pose.position'? its fields are pose, covariance"


def test_a_comment_in_python_silences_a_finding(check):
    code = f'{USE_ALL}\ndef hear(node, m):\n    use(node)\n    print(nobody)  # composer: ignore[undefined-name]\n'
    assert check(SYSTEM, code, installed=False) == []
    text = code.replace('print(nobody)', "print(nobody, '''\n").replace('name]\n', "name]''')\n")
    assert [rule for _, rule in check(SYSTEM, text, installed=False)] == ['undefined-name']


ANSWER = """
  switch:
    services:
      use: {type: std_srvs/srv/SetBool, behaviour: parts:use}
"""
GIVES = "return {'success': True}"
# Ways on which a service may give no response, and the line that says so.
UNANSWERED = {
    f'if request.data: {GIVES}': 1,
    f'try: {GIVES}\n    except OSError: pass': 1,
    f'try: {GIVES}\n    except OSError: return': 3,
    f'while request.data: {GIVES}': 1,
    f'if request.data: return None\n    {GIVES}': 2,
    f'with open("x") as file:\n        if file: {GIVES}': 1,
    f'for _ in range(3):\n        try: {GIVES}\n        except OSError: print()': 1,
}
ANSWERED = (
    f'if request.data: {GIVES}\n    raise ValueError',
    f'while True:\n        if request.data: {GIVES}',
    f'match request.data:\n        case True: {GIVES}\n        case _: {GIVES}',
    f'try: {GIVES}\n    finally: print()',
    f'try: x = open("x")\n    except OSError: raise\n    else: {GIVES}',
    f'if request.data: {GIVES}\n    else: {GIVES}',
    f'if request.data: {GIVES}\n    fail()\n\ndef fail(): raise ValueError',
    f'try: {GIVES}\n    except OSError: fail()\n\nimport sys\ndef fail(): sys.exit(1)',
    # Ways that may not be there.
    f'if request.data: {GIVES}\n    elif not request.data: {GIVES}',
    f'bad = not request.data\n    if bad: {GIVES}\n    if request.data: {GIVES}',
    f'good, bad = divmod(request.data, 5)\n    if good or bad: {GIVES}',
    f'low, high = 1, 2\n    if request.data > low or request.data > high: {GIVES}',
    f'x = open("x")\n    if x.readable(): {GIVES}\n    elif x.writable(): {GIVES}',
    f'match request.data:\n        case True: {GIVES}\n        case False: {GIVES}',
    f'while request.data:\n        if node.name: {GIVES}\n    else: {GIVES}',
    f'for n in range(3):\n        try: {GIVES}\n        except OSError:\n            if n == 2: {GIVES}',
    f'import itertools\n    for n in itertools.count():\n        if node.state: {GIVES}',
    *(
        f'import os, sys, typing\n    if request.data: {GIVES}\n    {end}'
        for end in ('sys.exit(1)', 'os._exit(1)', 'typing.assert_never(request)', 'assert False')
    ),
)


@pytest.mark.ros
@pytest.mark.parametrize(('body', 'line'), UNANSWERED.items(), ids=UNANSWERED)
def test_a_way_without_a_response_is_found(check, body, line):
    assert check(ANSWER, f'def use(node, request):\n    {body}\n') == [(line, 'missing-return')]


@pytest.mark.ros
@pytest.mark.parametrize(
    ('body', 'findings'),
    [
        ('for n in range(3): yield {"sequence": [n]}', [(1, 'missing-return')]),
        ('yield {"sequence": [1]}\n    return', [(3, 'missing-return')]),
        ('yield {"sequence": [1]}\n    return {"sequence": [1]}', []),
        ('while True: yield {"sequence": [1]}', []),
        ('import itertools\n    for n in itertools.count(): yield {"sequence": [n]}', []),
        ('yield {"sequence": [1]}\n    raise ValueError', []),
    ],
)
def test_a_generator_of_an_action_returns_its_result(check, body, findings):
    system = ANSWER.replace('services', 'actions').replace(
        'std_srvs/srv/SetBool', 'test_msgs/action/Fibonacci'
    )
    assert check(system, f'def use(node, goal):\n    {body}\n') == findings


# Ways that a parameter, an exception or a helper decides.
DOUBTFUL = {
    f'import contextlib\n    with contextlib.suppress(OSError): {GIVES}': 1,
    f'if node.parameters.on: {GIVES}': 1,
    f'if node.name == "switch": {GIVES}': 1,
}


@pytest.mark.ros
@pytest.mark.parametrize(('body', 'line'), DOUBTFUL.items(), ids=DOUBTFUL)
def test_a_way_that_may_give_no_response_is_a_warning(check, body, line):
    system = ANSWER.replace('    services', '    parameters: {on: true}\n    services')
    code = f'def use(node, request):\n    {body}\n'
    found = [each for each in check(system, code) if each[1] != 'unused-parameter']
    assert found == [(line, 'missing-return')]


@pytest.mark.ros
@pytest.mark.parametrize('body', ANSWERED)
def test_a_response_on_all_ways_has_no_finding(check, body):
    assert check(ANSWER, f'def use(node, request):\n    {body}\n') == []
