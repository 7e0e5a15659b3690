"""Subscriptions: what is called with a message, and what is passed on."""

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import Point, Twist
from std_msgs.msg import Int32, String

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  ears:
    publishers:
      shouted: std_msgs/msg/String
      doubled: std_msgs/msg/Int32
      relayed: {type: geometry_msgs/msg/Twist, topic: elsewhere}
      single: geometry_msgs/msg/Point
      wrong: std_msgs/msg/Int32
    subscriptions:
      word:
        type: std_msgs/msg/String
        behaviour: parts:shout
        with: {suffix: '!'}
        publish: shouted
      number: {type: std_msgs/msg/Int32, behaviour: 'parts:double', publish: doubled}
      twist: {type: geometry_msgs/msg/Twist, publish: relayed}
      point: {type: std_msgs/msg/Int32, behaviour: 'parts:to_point', publish: single}
      finding: {type: std_msgs/msg/Int32, behaviour: 'parts:to_words', publish: wrong}
  best:
    subscriptions:
      spoken:
        type: std_msgs/msg/String
        qos: best_available
        behaviour: parts:shout
        with: {suffix: ''}
  mouth:
    publishers: {spoken: {type: std_msgs/msg/String, qos: sensor_data}}
    timers: {speak: {period: 0.05, publish: spoken, message: hello}}
  patient:
    state: {started: false}
    subscriptions: {early: {type: std_msgs/msg/Int32, behaviour: 'parts:hear_early'}}
    on_start: parts:start
"""

CODE = """
import time
from pathlib import Path

from rclpy.task import Future

def shout(node, message, suffix):
    node.logger.info(f'heard {type(message).__name__} {message.data}')
    return message.data.upper() + suffix if message.data else None

async def double(node, message):
    future = Future()
    future.set_result(2)
    return message.data * await future

def to_point(node, message):
    return {'x': message.data, 'y': 0.5}

def to_words(node, message):
    return 'three'  # composer: ignore[field-type]

def start(node):
    node.logger.info('starting')
    while not Path('published').exists():
        time.sleep(0.01)
    time.sleep(0.1)
    node.state.started = True

def hear_early(node, message):
    node.logger.info(f'heard {message.data}, started: {node.state.started}')
"""


@pytest.fixture(scope='module')
def child(shared_compose, shared_peer):
    child = shared_compose(SYSTEM, CODE)
    child.wait_for_line('starting')
    publisher = shared_peer.advertise(Int32, 'early')
    for number in range(3):
        publisher.publish(Int32(data=number))
    (shared_compose.folder / 'published').touch()
    child.wait_until_ready()
    return child


@pytest.fixture
def exchange(child, shared_peer, wait_for):
    """Publish messages on one topic and return the first that comes back on another."""

    def exchange(topic, messages, answer_topic, answer_class):
        heard = shared_peer.listen(answer_class, answer_topic)
        wait_for(
            lambda: shared_peer.node.count_publishers(answer_topic), 'the publisher of answers'
        )
        publisher = shared_peer.advertise(type(messages[0]), topic)

        def answered():
            for message in messages:
                publisher.publish(message)
            return heard

        # The way back may be found later than the way there, so the first may go unheard.
        return wait_for(answered, 'an answer')[0]

    return exchange


def test_a_function_gets_node_and_message_and_its_result_is_published(child, exchange):
    answer = exchange('word', [String(data='hello')], 'shouted', String)

    assert answer.data == 'HELLO!'
    child.wait_for_line('[INFO] [ears]: heard String hello')


def test_an_async_function_is_awaited(exchange):
    assert exchange('number', [Int32(data=21)], 'doubled', Int32).data == 42


def test_without_a_behaviour_messages_are_passed_on_as_they_are(exchange):
    twist = Twist()
    twist.linear.y, twist.angular.x = 1.5, -2.5

    assert exchange('twist', [twist], 'elsewhere', Twist) == twist


def test_a_mapping_becomes_a_message_with_its_integers_made_doubles(exchange):
    assert exchange('point', [Int32(data=3)], 'single', Point) == Point(x=3.0, y=0.5)


def test_a_payload_of_another_type_is_an_error_that_names_field_and_types(child, shared_peer):
    shared_peer.advertise(Int32, 'finding').publish(Int32(data=3))

    line = child.wait_for_line("[ERROR] [ears]: subscription 'finding' (system.yaml:20) raised")
    assert line.startswith(
        "[ERROR] [ears]: subscription 'finding' (system.yaml:20) raised PayloadError: "
    )
    assert 'data' in line
    assert 'int32' in line
    assert "'three'" in line


def test_messages_that_come_before_the_start_is_over_wait_for_it(child):
    child.wait_for_line('[patient]: heard 2')
    assert child.matching('[patient]: heard') == [
        f'[INFO] [patient]: heard {number}, started: True' for number in range(3)
    ]


def test_the_best_available_qos_fits_publishers_of_nodes_that_stand_below(child):
    child.wait_for_line('[best]: heard String hello')
