"""Calls and goals within a system are the same, handed over or sent."""

import json

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

CODE = """
import json
import threading
import time

from rclpy.qos import QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState
from test_msgs.action import Fibonacci
from test_msgs.srv import Arrays, BasicTypes

import composer

kept, held, callers, ways = [], [], [], []
began, goes_on = threading.Event(), threading.Event()
LIMIT = 5.0

def tell(node, what, *values):
    node.logger.info('seen: ' + json.dumps([what, *values]))

def note_way():
    time.sleep(0.02)  # rclpy notes a request after it has sent it.
    is_sent = any(each._pending_requests for each in callers[0].ros.clients)
    is_here = threading.get_ident() == callers[1]
    ways.append('sent' if is_sent else 'here' if is_here else 'handed')

def answer(node, request):
    return {'success': True}

def echo(node, request):
    if request.string_value:
        note_way()
    return {'float32_value': request.float32_value, 'string_value': request.string_value}

def keep(node, request):
    # The server changes what it got, and keeps what it answers.
    request.int32_values[0] = -1
    request.string_values[0] = 'server'
    request.basic_types_values[0].int32_value = -1
    response = Arrays.Response()
    response.int32_values[:] = [7, 8, 9]
    kept[:] = [request, response]
    return response

async def relay(node, request):
    inner = await node.call_async('echo', BasicTypes.Request(string_value=request.string_value + '!'))
    return BasicTypes.Response(string_value=inner.string_value)

def fail(node, request):
    raise OSError('no such device')

def hold(node, request):
    held.append(request.int32_value)
    began.set()
    goes_on.wait(30)
    time.sleep(0.1)  # Of more answers than its queue holds, the first would be lost.
    return {'int32_value': request.int32_value}

def failure(call):
    try:
        return str(call())
    except composer.ComposerError as error:
        return f'{type(error).__name__}: {error}'

def play(node):
    callers[:] = [node, threading.get_ident()]
    deadline = time.monotonic() + 20
    while not ways or (LIMIT is None and 'here' not in ways and time.monotonic() < deadline):
        # Where the server's group is busy for a moment, or took long the last time, it is handed
        # over.
        time.sleep(0.01)
        node.call('echo', {}, LIMIT)
        response = node.call('echo', {'float32_value': 0.1, 'string_value': 'x'}, LIMIT)
    tell(node, 'values', response.float32_value, response.string_value)
    keep_apart(node)
    tell(node, 'relay', node.call('relay', {'string_value': 'y'}, LIMIT).string_value)
    tell(node, 'fails', failure(lambda: node.call('fail', timeout=0.4)))
    tell(node, 'is late', failure(lambda: node.call('hold', timeout=0.3)))
    goes_on.set()
    tell(node, 'goes on', node.call('hold', {'int32_value': 1}, LIMIT).int32_value, held)
    overflow(node)
    introspect(node)
    pursue(node)
    node.logger.info('ways: ' + ' '.join(ways))
    node.logger.info('played')
    yield

def keep_apart(node):
    mine = Arrays.Request()
    for _ in range(2):
        mine.int32_values[0] = 5
        response = node.call('keep', mine, LIMIT)
        tell(node, 'mine', int(mine.int32_values[0]), mine.string_values[0], mine.basic_types_values[0].int32_value)
        response.int32_values[1] = 100
        kept[1].int32_values[2] = 200
        tell(node, 'apart', response.int32_values.tolist(), kept[1].int32_values.tolist())
    node.call('keep', Arrays.Request(), LIMIT)
    tell(node, 'let go', kept[0].int32_values.tolist(), kept[0].string_values)

def overflow(node):
    # The first keeps the server busy; of the others, its queue keeps the last three.
    del held[:]
    goes_on.clear()
    began.clear()
    answers, threads = [], []

    def call(number):
        # That a request was dropped is known at once where it was handed over.
        try:
            # Those that are dropped on the way are waited for in vain.
            limit = 2.5 if 0 < number < 5 else 30.0
            answers.append(str(node.call('hold', {'int32_value': number}, limit).int32_value))
        except composer.CallError:
            answers.append('dropped')

    for number in range(8):
        threads.append(threading.Thread(target=call, args=(number,)))
        threads[-1].start()
        began.wait(30)
        time.sleep(0.1)  # Nothing else tells that a request has come to the queue.
    goes_on.set()
    for thread in threads:
        thread.join()
    tell(node, 'overflow', sorted(answers), held)

def introspect(node):
    client = next(each for each in node.ros.clients if each.srv_name.endswith('echo'))
    for state in (ServiceIntrospectionState.METADATA, ServiceIntrospectionState.OFF):
        client.configure_introspection(node.ros.get_clock(), QoSProfile(depth=10), state)
        tell(node, 'introspected', node.call('echo', {'string_value': 'z'}, LIMIT).string_value)

def may_begin(node, goal):
    return goal.order < 100

def climb(node, goal):
    shared = Fibonacci.Feedback(sequence=[0])
    for step in range(goal.order):
        shared.sequence[0] = step
        yield shared
    if goal.order == 50:
        while True:
            time.sleep(0.01)
            yield None
    if goal.order == 51:
        raise OSError('fell')
    result = Fibonacci.Result(sequence=[goal.order])
    node.state.result = result
    goal.order = -1
    return result

def pursue(node):
    wish = Fibonacci.Goal(order=5)
    goal = node.send_goal('climb', wish)
    feedback = [each.sequence.tolist() for each in goal.feedback]
    tell(node, 'climbed', feedback, goal.result().sequence.tolist(), goal.status, wish.order)
    tell(node, 'refused', failure(lambda: node.send_goal('climb', {'order': 100})))
    goal = node.send_goal('climb', {'order': 50})
    late = failure(lambda: goal.result(timeout=0.1))
    tell(node, 'cancelled', goal.status, late, goal.cancel(), goal.result().sequence.tolist(), goal.status)
    tell(node, 'again', goal.cancel())
    goal = node.send_goal('climb', {'order': 51})
    tell(node, 'aborted', len(list(goal.feedback)), goal.result().sequence.tolist(), goal.status)
"""


def render(local):
    """Return a system whose client plays a scenario of calls and goals, and says what it sees."""
    services = {
        'echo': 'BasicTypes',
        'keep': 'Arrays',
        'relay': 'BasicTypes',
        'fail': 'Empty',
        'hold': 'BasicTypes',
    }
    clients = '\n'.join(
        f'              {name}: {{type: test_msgs/srv/{kind}, qos: 8}}'
        for name, kind in services.items()
    )
    served = '\n'.join(
        f"              {name}: {{type: test_msgs/srv/{kind}, behaviour: 'parts:{name}', qos: 3, group: {name}}}"
        for name, kind in services.items()
    )
    return f"""
        version: 1
        defaults: {{local_delivery: {local}}}
        nodes:
          client:
            service_clients:
{clients}
            action_clients:
              climb: {{type: test_msgs/action/Fibonacci}}
            timers: {{play: {{period: 0.05, behaviour: 'parts:play', group: own}}}}
          server:
            state: {{result: null}}
            service_clients: {{echo: test_msgs/srv/BasicTypes}}
            services:
              out: {{type: std_srvs/srv/Trigger, behaviour: 'parts:answer', group: out}}
{served}
            actions:
              climb: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:climb', accept: 'parts:may_begin'}}
    """


def play(compose, peer, local, limit=5.0):
    """Return what the client saw, and which way its calls went."""
    child = compose(render(local), CODE.replace('LIMIT = 5.0', f'LIMIT = {limit}'))
    child.wait_until_ready()
    # A client outside is served meanwhile.
    assert peer.call(Trigger, 'out').success
    child.wait_for_line('played')
    assert child.stop() == 0
    seen = [json.loads(line.partition('seen: ')[2]) for line in child.matching('seen: ')]
    return seen, child.matching('ways: ')[0].partition('ways: ')[2].split()


def test_calls_and_goals_are_the_same_handed_over_or_sent(compose, peer):
    sent, ways = play(compose, peer, local='false')
    assert 'sent' in ways
    handed, ways = play(compose, peer, local='true')

    assert handed == sent
    # The last but one is introspected.
    assert ways == ['handed'] * (len(ways) - 2) + ['sent', 'handed']

    unlimited, ways = play(compose, peer, local='true', limit=None)
    assert unlimited == sent
    # After it, one is of a coroutine.
    first = ways.index('here') + 1
    assert ways[first : first + 2] == ['handed', 'sent']
