"""Foxglove's protocol, spoken by a client of its own to a system that runs."""

import json
import re
import socket
import struct
import time
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('foxglove')
pytest.importorskip('websockets')

from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Int64, Int64MultiArray, String
from std_srvs.srv import SetBool
from websockets.sync.client import connect

from composer.cli.main import run
from tests.running import Peer, wait_for

pytestmark = pytest.mark.ros

PATIENCE_SEC = 15.0
SYSTEM = """
version: 1
diagnostics: {period: 0.2}
workers: {other: {}}
nodes:
  talker:
    parameters: {speed: 1.5, gains: [1.0, 2.0], mode: slow}
    publishers:
      count: {type: std_msgs/msg/Int64}
      map: {type: std_msgs/msg/String, qos: {durability: transient_local}}
      big: {type: std_msgs/msg/String}
      kept: {type: std_msgs/msg/Int64}
      values: {type: std_msgs/msg/Int64MultiArray}
    timers:
      change: {rate: 20, behaviour: parts:change}
      tick: {rate: 50, behaviour: parts:tick, publish: count, group: own}
      grow: {rate: 10, behaviour: parts:grow, publish: big}
    on_start: parts:draw
    services: {switch: {type: std_srvs/srv/SetBool, behaviour: parts:switch}}
  hearer:
    subscriptions:
      count: {type: std_msgs/msg/Int64, behaviour: parts:hear}
      said: {type: std_msgs/msg/String, external: true, behaviour: parts:repeat}
  far:
    worker: other
    publishers: {far: {type: std_msgs/msg/Int64, external: true}}
    timers: {tick: {rate: 20, behaviour: parts:tick, publish: far}}
"""
CODE = """
from std_msgs.msg import Int64, Int64MultiArray

def tick(node):
    node.state.count = getattr(node.state, 'count', 0) + 1
    return node.state.count

kept, values = Int64(), []

def change(node):
    for _ in range(3):
        kept.data += 1
        node.publish('kept', kept)
        node.publish('values', of_values())
        values[-1][0] = -1

def of_values():
    message = Int64MultiArray(data=[kept.data])
    values.append(message.data)
    return message

def grow(node):
    return 'x' * 1_000_000

def draw(node):
    node.publish('map', {'data': 'the map'})

def switch(node, request):
    return {'success': not request.data, 'message': f'was {request.data}'}

def hear(node, message):
    pass

def repeat(node, message):
    print(f'heard {message.data}')
"""


class Foxglove:
    """A client that has all that came, by the kind."""

    def __init__(self, socket):
        self.socket = socket
        self.channels, self.services = {}, {}
        self.seen = []
        self.data = {}

    def send(self, op, **fields):
        self.socket.send(json.dumps({'op': op, **fields}))

    def take(self, timeout_sec=0.1):
        try:
            came = self.socket.recv(timeout_sec)
        except TimeoutError:
            return
        if isinstance(came, bytes):
            kind, number = struct.unpack_from('<BI', came)
            self.data.setdefault((kind, number), []).append(came[5:])
            return
        document = json.loads(came)
        self.seen.append(document)
        self.channels |= {each['topic']: each for each in document.get('channels', ())}
        if document['op'] == 'advertiseServices':
            self.services |= {each['name']: each for each in document['services']}

    def wait_for(self, condition, what):
        def arrived():
            self.take()
            return condition()

        return wait_for(arrived, what, PATIENCE_SEC)

    def wait_for_op(self, op, condition=lambda _: True):
        return self.wait_for(
            lambda: next((s for s in self.seen if s['op'] == op and condition(s)), None), op
        )

    def subscribe(self, topic, number):
        self.wait_for(lambda: topic in self.channels, topic)
        ids = {'id': number, 'channelId': self.channels[topic]['id']}
        self.send('subscribe', subscriptions=[ids])

    def messages(self, number, message_class, count=1):
        self.wait_for(lambda: len(self.data.get((1, number), ())) >= count, f'{count} messages')
        # After the number is the time.
        return [deserialize_message(each[8:], message_class) for each in self.data[1, number]]

    def parameters(self, *names):
        self.seen.clear()
        self.send('getParameters', parameterNames=names, id='get')
        answer = self.wait_for_op('parameterValues')
        return {each['name']: each['value'] for each in answer['parameters']}

    def call(self, service, request):
        self.wait_for(lambda: service in self.services, service)
        number = self.services[service]['id']
        head = struct.pack('<BIII', 2, number, 1, 3)
        self.socket.send(head + b'cdr' + serialize_message(request))
        (answer,) = self.wait_for(lambda: self.data.get((3, number)), 'the response')
        return deserialize_message(answer[11:], SetBool.Response)


@contextmanager
def connected(port, **options):
    url, protocols = f'ws://127.0.0.1:{port}', ['foxglove.sdk.v1']
    # Who leaves waits for no answer behind all that is still sent.
    more = {'max_size': None, 'close_timeout': 0.1, **options}
    with connect(url, subprotocols=protocols, **more) as socket:
        yield Foxglove(socket)


def is_connected(client):
    """Return whether the kernel still has a connection: TCP_CLOSE is 7."""
    # The library closes it once it has noticed its end.
    with suppress(OSError):
        return client.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0] != 7
    return False


def port_of(system):
    return int(re.search(r'ws://127\.0\.0\.1:(\d+)', system.output)[1])


@pytest.fixture(scope='module')
def system(shared_compose):
    """Run a system that clients may change."""
    system = shared_compose(SYSTEM, CODE, '--foxglove', '0', '--allow-changes')
    system.wait_until_ready()
    yield system
    assert system.stop() == 0
    assert not system.matching('ERROR')


@pytest.fixture
def port(system):
    """Return the port at which the system is served."""
    return port_of(system)


@pytest.fixture
def domain_id(shared_compose, system, monkeypatch):
    """Return the domain of the system, which what tests run beside it is in, too."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(shared_compose.domain_id))
    return shared_compose.domain_id


def test_clients_see_what_nodes_publish_and_nothing_changes_by_it(port, peer, capsys):
    sender = peer.run(peer.node.create_publisher, String, '/outside', 10)
    with connected(port) as one, connected(port) as two:
        one.subscribe('/count', 1)
        one.subscribe('/map', 2)
        one.subscribe('/far', 3)
        one.subscribe('/outside', 4)
        one.subscribe('/kept', 5)
        one.subscribe('/values', 6)
        numbers = [message.data for message in one.messages(1, Int64, count=20)]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        # What is changed after it was published is as it was then.
        for number, message_class in ((5, Int64), (6, Int64MultiArray)):
            came = [message.data for message in one.messages(number, message_class, count=9)]
            numbers = [each if isinstance(each, int) else each[0] for each in came]
            assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert one.messages(2, String)[0].data == 'the map'
        assert len(one.messages(3, Int64, count=5)) >= 5
        wait_for(sender.get_subscription_count, 'the bridge')
        sender.publish(String(data='hello'))
        assert one.messages(4, String)[0].data == 'hello'
        # A latched message comes to who is later, too.
        two.subscribe('/map', 2)
        assert two.messages(2, String)[0].data == 'the map'
        # What was handed over still is.
        assert run(['top', '--once', '--format', 'json']) == 0
        entities = json.loads(capsys.readouterr().out)['entities']
        ways = {(each['kind'], each['name']): each['delivery'] for each in entities}
        assert ways['publisher', 'count'] == 'local'
        schema = one.channels['/count']
        assert (schema['schemaName'], schema['schemaEncoding']) == (
            'std_msgs/msg/Int64',
            'ros2msg',
        )
        assert 'int64 data' in schema['schema']
        one.send('unsubscribe', subscriptionIds=[4])
        wait_for(lambda: not sender.get_subscription_count(), 'the end of the subscription')


def test_who_does_not_read_holds_nobody_up_and_is_disconnected(port):
    with ExitStack() as stack:
        # It takes nothing more from the kernel than fits its queue, and only its pings find out.
        pings = {'ping_interval': 0.2, 'ping_timeout': None}
        mute = stack.enter_context(connected(port, max_queue=1, **pings))
        mute.subscribe('/count', 1)
        mute.subscribe('/big', 2)
        reader = stack.enter_context(connected(port))
        reader.subscribe('/count', 1)
        for _ in range(3):
            with ExitStack() as short:
                for one in [short.enter_context(connected(port)) for _ in range(20)]:
                    one.subscribe('/count', 1)
        numbers = [message.data for message in reader.messages(1, Int64, count=100)]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        wait_for(lambda: not is_connected(mute.socket.socket), 'the end of the connection')
        assert is_connected(reader.socket.socket)


def test_a_system_is_shown_from_beside_it_where_clients_change_and_keep_nothing(
    compose, port, node, domain_id, capsys
):
    assert run(['foxglove', 'nobody', '--port', '0']) == 1
    beside = compose.start('foxglove', '--port', '0')
    beside.wait_for_line('ws://')
    with closing(Peer(domain_id)), connected(port_of(beside)) as one:
        one.subscribe('/count', 1)
        assert len(one.messages(1, Int64, count=10)) >= 10
        one.send('setParameters', parameters=[{'name': '/talker.mode', 'value': 'fast'}], id='x')
        status = one.wait_for_op('status')
        assert status['message'] == 'parameters are set only with --allow-changes'
        assert not one.services
        # What is not there costs no other parameter.
        names = '/talker.mode', '/a b.c', '/peer.use_sim_time'
        expected = {'/talker.mode': 'slow', '/peer.use_sim_time': False}
        wait_for(lambda: one.parameters(*names) == expected, 'the parameters')

    def services():
        return [name for name, _ in node.get_service_names_and_types() if '/peer/' in name]

    # A client of it would keep its services on the graph.
    wait_for(lambda: not services(), 'the end of the node')
    assert beside.stop() == 0
    capsys.readouterr()
    path = compose.write('version: 1\nnodes: {alone: {}}\n', '', 'second')
    other = compose.run(path.name, '--foxglove', str(port))
    assert other.wait() == 1
    assert f'error: Foxglove cannot be served at 127.0.0.1:{port}' in other.output
    assert run(['up', str(path), '--allow-changes']) == 2
    assert 'are for --foxglove' in capsys.readouterr().err


def test_who_looks_at_the_graph_and_leaves_holds_nobody_up(port):
    for number in range(52):
        with connected(port) as one:
            one.send('subscribeConnectionGraph')
            one.send('subscribeParameterUpdates', parameterNames=['/talker.mode'])
            one.socket.recv(timeout=PATIENCE_SEC)
            # It leaves a little sooner or later: about when the graph is sent.
            time.sleep(number % 13 / 2000)
    with connected(port) as one:
        one.subscribe('/count', 1)
        assert one.messages(1, Int64, count=5)


def test_clients_change_the_system_where_they_may(system, port):
    with connected(port) as one:
        names = ('/talker.speed', '/talker.gains', '/talker.mode')
        assert one.parameters(*names) == dict(zip(names, (1.5, [1.0, 2.0], 'slow'), strict=True))
        assert set(names) <= one.parameters().keys()
        one.seen.clear()
        one.send('setParameters', parameters=[{'name': '/talker.mode', 'value': {'a': 1}}])
        refusal = one.wait_for_op('status')
        assert (
            refusal['message'] == "/talker.mode was not set: {'a': 1} is no value of a parameter"
        )
        one.seen.clear()
        one.send('subscribeParameterUpdates', parameterNames=['/talker.mode'])
        new = {'/talker.speed': 3, '/talker.gains': [4], '/talker.mode': 'fast', '/talker.no': 1}
        parameters = [{'name': name, 'value': value} for name, value in new.items()]
        one.send('setParameters', parameters=parameters, id='set')
        refusal = one.wait_for_op('status')
        assert refusal['message'].startswith('/talker.no was not set: ')
        assert one.parameters(*names) == dict(zip(names, (3.0, [4.0], 'fast'), strict=True))
        response = one.call('/switch', SetBool.Request(data=True))
        assert (response.success, response.message) == (False, 'was True')
        channel = {
            'id': 9,
            'topic': '/said',
            'encoding': 'cdr',
            'schemaName': 'std_msgs/msg/String',
        }
        one.send('advertise', channels=[channel])
        data = struct.pack('<BI', 1, 9) + serialize_message(String(data='this'))
        deadline = time.monotonic() + PATIENCE_SEC
        while not system.matching('heard this') and time.monotonic() < deadline:
            # The first may come before the subscription has met the publisher.
            one.socket.send(data)
            one.take()
        assert system.matching('heard this')
        one.send('subscribeConnectionGraph')
        graph = one.wait_for_op('connectionGraphUpdate', lambda each: each['publishedTopics'])
        published = {each['name']: each['publisherIds'] for each in graph['publishedTopics']}
        heard = {each['name']: each['subscriberIds'] for each in graph['subscribedTopics']}
        served = {each['name']: each['providerIds'] for each in graph['advertisedServices']}
        assert published['/count'] == ['/talker']
        assert heard['/count'] == ['/hearer']
        assert served['/switch'] == ['/talker']
        assert published['/far'] == ['/far']
