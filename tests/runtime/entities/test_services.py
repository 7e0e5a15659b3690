"""Services that systems serve, called by a plain rclpy node."""

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import Empty, SetBool, Trigger
from test_msgs.srv import BasicTypes

from tests.running import DEADLINE_SEC, wait_for

pytestmark = pytest.mark.ros

CODE = """
import threading
import time

from std_srvs.srv import Trigger

def as_mapping(node, request):
    return {'success': request.data, 'message': 'said'}

def as_message(node, request):
    return Trigger.Response(success=True, message='message')

async def as_coroutine(node, request):
    return {'success': True, 'message': 'async'}

def nothing(node, request):
    node.logger.info('nothing to say')
    return {}

def with_constant(node, request, text):
    return {'success': True, 'message': text}

def wrong_field(node, request):
    return {'succes': True}  # composer: ignore[unknown-field]

async def fail_async(node, request):
    raise OSError('no such device either')

def echo(node, request):
    return {'int64_value': request.int64_value, 'string_value': request.string_value * 2}

def alone(node, *request):
    node.state.inside += 1
    most = node.state.inside
    time.sleep(0.02)
    node.state.inside -= 1
    return {'success': most == 1}

def alone_in_timer(node):
    alone(node)

barrier = threading.Barrier(2)

def meet(node, request):
    barrier.wait(timeout=30)
    return {'success': True}
"""

SYSTEM = """
    version: 1
    nodes:
      server:
        namespace: /robot
        remap: {old_name: /moved/new_name}
        services:
          mapping: {type: std_srvs/srv/SetBool, behaviour: 'parts:as_mapping'}
          message: {type: std_srvs/srv/Trigger, behaviour: 'parts:as_message'}
          coroutine: {type: std_srvs/srv/Trigger, behaviour: 'parts:as_coroutine'}
          nothing: {type: std_srvs/srv/Empty, behaviour: 'parts:nothing'}
          constant:
            type: std_srvs/srv/Trigger
            behaviour: parts:with_constant
            with: {text: constant}
          own: {type: std_srvs/srv/Trigger, service: ~/own, behaviour: 'parts:as_message'}
          old_name: {type: std_srvs/srv/Trigger, behaviour: 'parts:as_message'}
          top: {type: std_srvs/srv/Trigger, service: /top, behaviour: 'parts:as_message'}
          echo: {type: test_msgs/srv/BasicTypes, behaviour: 'parts:echo'}
          wrong_field: {type: std_srvs/srv/Trigger, behaviour: 'parts:wrong_field'}
          fail_async: {type: std_srvs/srv/Trigger, behaviour: 'parts:fail_async'}
          best_effort:
            type: std_srvs/srv/Trigger
            behaviour: parts:as_message
            qos: {reliability: best_effort, depth: 3}
          meet: {type: std_srvs/srv/Trigger, behaviour: 'parts:meet', group: reentrant}
      alone:
        state: {inside: 0}
        timers: {tick: {period: 0.05, behaviour: 'parts:alone_in_timer'}}
        services: {ask: {type: std_srvs/srv/Trigger, behaviour: 'parts:alone'}}
"""


@pytest.fixture(scope='module')
def child(shared_compose):
    child = shared_compose(SYSTEM, CODE)
    child.wait_until_ready()
    return child


@pytest.fixture
def connect(child, shared_peer):
    """Return a function that returns a client that the server has found."""
    clients = []

    def connect(service_class, name, **options):
        create = shared_peer.node.create_client
        clients.append(shared_peer.run(create, service_class, f'/robot/{name}', **options))
        assert clients[-1].wait_for_service(DEADLINE_SEC)
        # Ends are found in the order in which they were made: who answers this knows the client.
        shared_peer.call(Trigger, '/robot/message')
        return clients[-1]

    yield connect
    for client in clients:
        shared_peer.run(shared_peer.node.destroy_client, client)


def ask(client, requests):
    """Send requests at once; return their responses."""
    futures = [client.call_async(request) for request in requests]
    wait_for(lambda: all(future.done() for future in futures), 'all responses')
    return [future.result() for future in futures]


def test_mappings_messages_coroutines_and_constants_become_the_response(child, shared_peer):
    yes = shared_peer.call(SetBool, '/robot/mapping', data=True)
    assert (yes.success, yes.message) == (True, 'said')
    assert shared_peer.call(Empty, '/robot/nothing') == Empty.Response()
    child.wait_for_line('[robot.server]: nothing to say')
    for name, text in {'message': 'message', 'coroutine': 'async', 'constant': 'constant'}.items():
        response = shared_peer.call(Trigger, f'/robot/{name}')
        assert (response.success, response.message) == (True, text)


def test_private_remapped_and_absolute_names_are_served(child, shared_peer):
    for name in ('/robot/server/own', '/moved/new_name', '/top'):
        assert shared_peer.call(Trigger, name).message == 'message'


def test_a_response_goes_to_the_request_it_is_for(connect):
    requests = [BasicTypes.Request(int64_value=n, string_value=str(n)) for n in range(8)]
    responses = ask(connect(BasicTypes, 'echo'), requests)
    answers = [(response.int64_value, response.string_value) for response in responses]
    assert answers == [(number, str(number) * 2) for number in range(8)]


@pytest.mark.parametrize(
    ('name', 'summary', 'function'),
    [
        ('fail_async', 'OSError: no such device either', 'in fail_async\n'),
        ('wrong_field', "PayloadError: std_srvs/srv/Trigger_Response has no field 'succes'", ''),
    ],
)
def test_a_behaviour_that_raises_sends_no_response_and_is_in_the_log(
    child, shared_peer, connect, name, summary, function
):
    future = connect(Trigger, name).call_async(Trigger.Request())
    line = child.wait_for_line(f"service '{name}'")
    # What is asked later is answered: the former answer would have come before it.
    assert shared_peer.call(Trigger, '/robot/message').success

    assert line.startswith(f"[ERROR] [robot.server]: service '{name}' (system.yaml:")
    assert summary in line
    assert function in child.output
    assert not future.done()


def test_the_quality_of_service_is_the_declared_one(shared_peer, connect):
    profile = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
    connect(Trigger, 'best_effort', qos_profile=profile)

    def readers():
        found = shared_peer.node.get_subscriptions_info_by_topic(
            'rq/robot/best_effortRequest', no_mangle=True
        )
        return [info for info in found if info.node_name == 'server']

    # An end may be found before the name of its node.
    theirs = wait_for(readers, 'the end of the server')
    assert [info.qos_profile.reliability for info in theirs] == [ReliabilityPolicy.BEST_EFFORT]


def test_a_service_runs_never_beside_the_nodes_other_behaviours(child, shared_peer):
    assert [shared_peer.call(Trigger, 'ask').success for _ in range(10)] == [True] * 10


def test_requests_of_a_reentrant_service_run_beside_each_other(connect):
    client = connect(Trigger, 'meet')
    assert [response.success for response in ask(client, [Trigger.Request()] * 2)] == [True, True]
