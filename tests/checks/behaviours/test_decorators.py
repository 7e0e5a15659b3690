"""Behaviours under decorators of the project are checked as those without are."""

import pytest

SYSTEM = """
  rover:
    parameters: {speed: 1.0}
    publishers:
      command: {type: geometry_msgs/msg/Twist, external: true}
      level: {type: std_msgs/msg/Float64, external: true}
    service_clients: {enable: {type: std_srvs/srv/SetBool, external: true}}
    subscriptions:
      odom:
        {type: nav_msgs/msg/Odometry, external: true, behaviour: 'parts:hear', publish: level}
    timers: {tick: {period: 1, behaviour: 'parts:Driver.tick'}}
"""
TOOLS = """
from functools import wraps as w

def traced(function):
    @w(function)
    def inner(*args, **kwargs):
        print(function.__name__)
        return function(*args, **kwargs)
    return inner
"""
HEAD = """
import functools
import time
import tools

def timed(function):
    @functools.wraps(function)
    def inner(node, *args):
        start = time.monotonic()
        try:
            return function(node, *args)
        finally:
            node.logger.info(f'{function.__qualname__}: {time.monotonic() - start}')
    return inner

def retry(times):
    def decorate(function):
        @functools.wraps(function)
        def inner(*args):
            for attempt in range(times):
                try:
                    return function(*args)
                except RuntimeError:
                    if attempt == times - 1:
                        raise
        return inner
    return decorate

def awaited(function):
    @functools.wraps(function)
    async def inner(*args):
        return await function(*args)
    return inner

def quiet(function):
    @functools.wraps(function)
    def inner(*args):
        function(*args)
    return inner

def swallows(function):
    @functools.wraps(function)
    def inner(*args):
        try:
            return function(*args)
        except KeyError:
            return None
    return inner

def drops(function):
    @functools.wraps(function)
    def inner(*args):
        try:
            return function(*args)
        finally:
            return None
    return inner

def measures(function):
    @functools.wraps(function)
    def inner(node, message):
        message = message.pose.pose.position.x
        return function(node, message)
    return inner

def swaps(function):
    @functools.wraps(function)
    def inner(node, message):
        return function(message, node)
    return inner

def never(function):
    @functools.wraps(function)
    def inner(*args):
        print('off')
    return inner

def bare(function):
    def inner(node, message):
        return function(node, message)
    return inner

def kept(function):
    @keep(function)
    def inner(*args):
        return function(*args)
    return inner

def keep(function):
    return lambda inner: print

def use(node):
    node.publish('command', {'linear': {'x': node.parameters.speed}})
    node.call('enable', True)
"""
TICK = """
class Driver:
    @timed
    def tick(self, node):
        use(node)
"""
READ = 'def hear(node, message):\n    return {"data": message.pose.pose.position.x}'
# It is wrong of an odometry, and right if a decorator gives it something else.
OTHER = 'def hear(node, message):\n    return {"data": message.real}'
WRONG_NAME = 'def hear(node, message):\n    node.publish("levl", node.parameters["sped"])'
RIGHT = {
    'wraps': f'@timed\n{READ}',
    'factory': f'@retry(3)\n{READ}',
    'stacked': f'@timed\n@tools.traced\n@retry(times=2)\n{READ}',
    'async': f'@awaited\nasync {READ}',
    'other module': f'@tools.traced\n{READ}',
    'returns nothing': f'@quiet\n{READ.replace("data", "date")}',
    'catches': f'@swallows\n{WRONG_NAME}',
    'returns in finally': f'@drops\n{WRONG_NAME}',
    'catches below another': f'@timed\n@swallows\n{WRONG_NAME}',
    'changes the message': f'@measures\n{OTHER}',
    'swaps arguments': f'@swaps\n{READ.replace("node, message", "message, node")}',
    'never calls it': f'@never\n{WRONG_NAME}',
    'no wraps': f'@bare\n{OTHER}',
    'not functools.wraps': f'@kept\n{OTHER}',
    'of Python': f'@functools.cache\n{OTHER}',
}
WRONG = {
    'publisher': ('@timed', 'node.publish("levl", 1.0)', 'unknown-publisher'),
    'parameter': ('@retry(3)', 'print(node.parameters.sped)', 'unknown-parameter'),
    'field of the message': ('@tools.traced', 'print(message.poes)', 'unknown-field'),
    'field of a payload': ('@timed', 'node.publish("level", {"date": 1.0})', 'unknown-field'),
    'returned payload': ('@timed', 'return {"date": 1.0}', 'unknown-field'),
    'await': ('@awaited', 'node.call_async("enable", True)', 'missing-await'),
    'stacked': ('@timed\n@retry(3)\n@quiet', 'node.publish("levl", 1.0)', 'unknown-publisher'),
    'attribute': ('@quiet', 'node.nwo()', 'unknown-attribute'),
    'endless': ('@timed', 'while True: node.sleep(1)', 'endless-loop'),
}


@pytest.fixture(autouse=True)
def tools(tmp_path):
    (tmp_path / 'tools.py').write_text(TOOLS)


@pytest.mark.ros
@pytest.mark.parametrize('code', RIGHT.values(), ids=RIGHT)
def test_what_a_decorator_may_make_right_has_no_finding(check, code):
    assert check(SYSTEM, f'{HEAD}{TICK}\n{code}\n') == []


@pytest.mark.ros
@pytest.mark.parametrize(('decorators', 'line', 'rule'), WRONG.values(), ids=WRONG)
def test_what_is_wrong_below_a_decorator_is_found_in_its_line(check, decorators, line, rule):
    kind = 'async def' if decorators == '@awaited' else 'def'
    code = f'{HEAD}{TICK}\n{decorators}\n{kind} hear(node, message):\n    {line}\n'
    assert check(SYSTEM, code) == [(len(code.splitlines()), rule)]


@pytest.mark.ros
def test_what_is_wrong_in_a_decorated_method_is_found(check):
    code = f'{HEAD}{TICK}        node.publish("levl", 1.0)\n@timed\n{READ}\n'
    assert [rule for _, rule in check(SYSTEM, code)] == ['unknown-publisher']


@pytest.mark.ros
@pytest.mark.parametrize(
    ('decorator', 'more', 'is_found'),
    [
        ('timed', '', True),
        ('tools.traced', '', True),
        # Code of the decorator's module may use it.
        ('tools.traced', "def later(rover):\n    rover.call('enable')\n", False),
        ('bare', '', False),
    ],
)
def test_what_no_decorated_behaviour_uses_is_found(check, tmp_path, decorator, more, is_found):
    (tmp_path / 'tools.py').write_text(TOOLS + more)
    code = f'{HEAD}{TICK}\n@{decorator}\n{READ}\n'.replace("    node.call('enable', True)\n", '')
    assert check(SYSTEM, code) == ([(8, 'unused-service-client')] if is_found else [])
