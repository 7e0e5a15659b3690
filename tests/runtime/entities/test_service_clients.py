"""Calls of services from behaviours: of this process and of others, one and thousands."""

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

CODE = """
import time

import composer

def answer(node, request):
    return {'success': True, 'message': f'answer of {node.name}'}

def ask(node, *_):
    node.logger.info('heard: ' + node.call('ask', timeout=30).message)
    return {'success': True, 'message': 'asked'}

async def ask_async(node, *_):
    node.logger.info('heard: ' + (await node.call_async('ask', timeout=30)).message)
    return {'success': True, 'message': 'asked'}

def once(node):
    node.logger.info('heard: ' + node.call('ask', timeout=30).message)
    yield

def pending(node):
    return sum(len(client._pending_requests) for client in node.ros.clients)

def report(node, error):
    node.logger.info(f'{type(error).__name__}: {error} ({error.help}), {pending(node)} pending')

def ask_and_tell(node, timeout):
    try:
        node.call('ask', timeout=timeout)
    except composer.CallError as error:
        report(node, error)
    yield

async def ask_and_tell_async(node, timeout):
    try:
        await node.call_async('ask', timeout=timeout)
    except composer.CallError as error:
        report(node, error)
    yield

def fail(node, request):
    raise OSError('no such device')

def hold(node, request):
    time.sleep(1.0)
    return {'success': True}

def forward(node, request):
    response = node.call('further', {'int64_value': request.int64_value + 1}, timeout=30)
    return {'int64_value': response.int64_value}

def end_of_chain(node, request):
    return {'int64_value': request.int64_value}

def ask_chain(node):
    node.logger.info(f"end: {node.call('first', {'int64_value': 1}, timeout=30).int64_value}")
    yield

arrived = []

def gather(node, request):
    arrived.append(node)
    while len(arrived) < 8:
        node.call('ask', timeout=30)
    return {'success': True}

def ask_to_meet(node):
    node.call('ask', timeout=30)
    node.logger.info('met')
    yield

def wait_long(node, *_):
    node.logger.info('asking')
    node.call('ask', timeout=None)

async def wait_long_async(node, *_):
    node.logger.info('asking')
    await node.call_async('ask', timeout=None)

def undeclared(node):
    node.call('asc')  # composer: ignore[unknown-service-client]

def wrong_request(node):
    node.call('ask', {'dat': True})  # composer: ignore[unknown-field]
"""

# A plain rclpy server in a process of its own; of the requests of 'hang', none is answered.
PEER_CODE = """
import sys
import time
import rclpy
from std_srvs.srv import Trigger

def answer(request, response):
    if sys.argv[1] == 'hang':
        print('asked', flush=True)
        time.sleep(600)
    response.success, response.message = True, 'answer of a plain server'
    return response

rclpy.init()
node = rclpy.create_node('plain')
node.create_service(Trigger, 'ask', answer)
print('up', flush=True)
rclpy.spin(node)
"""


@pytest.fixture
def plain_server(domain_id, start_program):
    """Start a plain rclpy server; it is gone when the test ends."""

    def start(how):
        process = start_program('-c', PEER_CODE, how)
        assert process.stdout.readline() == 'up\n'
        return process

    return start


def asking(client):
    """Return a system with a node `client`, which has a client `ask`."""
    return f"""
        version: 1
        executor: {{threads: 2}}
        nodes:
          client:
            service_clients: {{ask: std_srvs/srv/Trigger}}
            {client}
    """


# Each client also gets the responses to the others, which are not its own.
WITHIN = """
version: 1
executor: {threads: 2}
nodes:
  server: {services: {ask: {type: std_srvs/srv/Trigger, behaviour: 'parts:answer'}}}
  start: {service_clients: &ask {ask: std_srvs/srv/Trigger}, on_start: 'parts:ask'}
  async_start: {service_clients: *ask, on_start: 'parts:ask_async'}
  timer: {service_clients: *ask, timers: {tick: {period: 0.05, behaviour: 'parts:once'}}}
  async_timer: {service_clients: *ask, timers: {tick: {period: 0.05, behaviour: 'parts:ask_async'}}}
  subscription:
    service_clients: *ask
    subscriptions: {heard: {type: std_msgs/msg/Empty, behaviour: 'parts:ask'}}
    publishers: {heard: std_msgs/msg/Empty}
    timers: {tick: {period: 0.05, publish: heard, message: {}}}
  own:
    service_clients: {ask: {type: std_srvs/srv/Trigger, service: ~/ask}}
    services: {~/ask: {type: std_srvs/srv/Trigger, behaviour: 'parts:answer', group: other}}
    timers: {tick: {period: 0.05, behaviour: 'parts:once'}}
  stop: {service_clients: *ask, on_stop: 'parts:ask'}
  async_stop: {service_clients: *ask, on_stop: 'parts:ask_async'}
  "link_{{ n }}":
    foreach: {n: [0, 1, 2, 3, 4, 5]}
    service_clients: {further: {type: test_msgs/srv/BasicTypes, service: "s{{ n + 1 }}"}}
    services: {"s{{ n }}": {type: test_msgs/srv/BasicTypes, behaviour: 'parts:forward'}}
  last: {services: {s6: {type: test_msgs/srv/BasicTypes, behaviour: 'parts:end_of_chain'}}}
  chain:
    service_clients: {first: {type: test_msgs/srv/BasicTypes, service: s0}}
    timers: {tick: {period: 0.05, behaviour: 'parts:ask_chain'}}
  # All of the calls wait until the last has come: each goes to a service that calls again.
  meeting:
    service_clients: {ask: {type: std_srvs/srv/Trigger, service: meet}}
    timers:
      "t{{ n }}":
        {foreach: {n: [0, 1, 2, 3, 4, 5, 6, 7]}, period: 0.02, behaviour: 'parts:ask_to_meet', group: "g{{ n }}"}
  relay:
    service_clients: *ask
    services: {meet: {type: std_srvs/srv/Trigger, behaviour: 'parts:gather', group: reentrant}}
"""


def test_every_behaviour_can_call_services_within_the_system(compose):
    """Also of its own node, nested and at once more than there are threads."""
    child = compose(WITHIN, CODE)
    for name in ('start', 'async_start', 'timer', 'async_timer', 'subscription'):
        child.wait_for_line(f'[{name}]: heard: answer of server')
    child.wait_for_line('[own]: heard: answer of own')
    child.wait_for_line('[chain]: end: 7')
    child.wait_for_line('[meeting]: met', times=8)

    assert child.stop() == 0
    for name in ('stop', 'async_stop'):
        assert child.matching(f'[{name}]: heard: answer of server')
    assert 'Error' not in child.output


def test_behaviours_can_call_a_service_of_another_process(compose, peer, plain_server):
    plain_server('answer')
    client = """on_start: parts:ask
            on_stop: parts:ask
            services:
              one: {type: std_srvs/srv/Trigger, behaviour: 'parts:ask'}
              other: {type: std_srvs/srv/Trigger, behaviour: 'parts:ask_async'}"""
    child = compose(asking(client), CODE)
    child.wait_until_ready()
    heard = '[client]: heard: answer of a plain server'
    assert len(child.matching(heard)) == 1
    for number, service in enumerate(('one', 'other'), start=2):
        assert peer.call(Trigger, service).message == 'asked'
        child.wait_for_line(heard, times=number)

    assert child.stop() == 0
    # A request is sent again where its response was late, so that there may be more.
    assert len(child.matching(heard)) >= 4


ERRORS = {
    'missing': (
        '0.2',
        "ServiceNotAvailableError: no server of '/missing' appeared within 0.2 s"
        ' (is it running, and is that its name?), 0 pending',
    ),
    'slow': (
        '0.3',
        "CallTimeoutError: '/slow' did not answer within 0.3 s (None), 0 pending",
    ),
    'failing': (
        '3.0',
        "ServiceFailedError: '/failing' did not answer: its behaviour raised an error"
        " (the server's log has the traceback), 0 pending",
    ),
}


def test_a_call_says_why_it_has_no_response_and_leaves_nothing_behind(compose):
    expected = {}
    clients = ''
    for kind, (timeout, message) in ERRORS.items():
        for behaviour in ('ask_and_tell', 'ask_and_tell_async'):
            expected[f'{kind}_{behaviour}'] = message
            clients += f"""
          {kind}_{behaviour}:
            service_clients: {{ask: {{type: std_srvs/srv/Trigger, service: {kind}}}}}
            timers:
              tick: {{period: 0.02, behaviour: 'parts:{behaviour}', with: {{timeout: {timeout}}}}}
"""
    child = compose(f"""
        version: 1
        nodes:
          server:
            services:
              slow: {{type: std_srvs/srv/Trigger, behaviour: 'parts:hold', group: reentrant}}
              failing: {{type: std_srvs/srv/Trigger, behaviour: 'parts:fail'}}
          wrong:
            service_clients: {{ask: {{type: std_srvs/srv/Trigger, service: failing}}}}
            timers:
              one: {{period: 0.02, behaviour: 'parts:undeclared', group: one}}
              other: {{period: 0.02, behaviour: 'parts:wrong_request', group: other}}
{clients}""", CODE)  # fmt: skip

    for name, message in expected.items():
        assert child.wait_for_line(f'[{name}]: ').endswith(f'[INFO] [{name}]: {message}')
    summary = "UndeclaredError: node 'wrong' declares no service client 'asc'"
    assert summary in child.wait_for_line("timer 'one' (system.yaml:")
    summary = "PayloadError: std_srvs/srv/Trigger_Request has no field 'dat'"
    assert summary in child.wait_for_line("timer 'other' (system.yaml:")
    assert child.stop() == 0


def test_a_signal_ends_an_on_start_that_waits_for_a_response(compose, plain_server):
    plain = plain_server('hang')
    child = compose(asking('on_start: parts:wait_long_async'), CODE)
    child.wait_for_line('asking')
    assert plain.stdout.readline() == 'asked\n'

    assert child.stop(once_up=False) == 130
    assert 'rror' not in child.output
    assert 'did not end' not in child.output


def test_a_signal_ends_timers_that_wait_for_a_server(compose):
    timers = """timers:
              one: {period: 0.02, behaviour: 'parts:wait_long', group: one}
              other: {period: 0.02, behaviour: 'parts:wait_long_async', group: other}"""
    child = compose(asking(timers), CODE)
    child.wait_for_line('asking', times=2)

    assert child.stop() == 0
    assert 'rror' not in child.output
    assert 'did not end' not in child.output
