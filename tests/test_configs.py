"""Each shipped system, run by `composer up` and seen by a plain rclpy peer in another process."""

from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def up(compose):
    """Run a shipped system from the project's root."""

    def run(name, *arguments):
        return compose.run(f'configs/{name}.yaml', *arguments, folder=ROOT)

    return run


def test_talker_listener_is_that_of_the_tutorial(up, peer, wait_for):
    """It counts from zero, and is heard inside and outside."""
    heard = peer.listen(String, 'topic')
    child = up('talker_listener')
    child.wait_until_ready()
    child.wait_for_line('[INFO] [minimal_subscriber]: I heard: "Hello World: 2"')
    wait_for(lambda: len(heard) >= 2, 'two messages')

    def endpoints():
        subscriptions = peer.node.get_subscriptions_info_by_topic('/topic')
        ends = peer.node.get_publishers_info_by_topic('/topic') + subscriptions
        return [end for end in ends if end.node_name != peer.node.get_name()]

    # An endpoint may be found before the node that it is of.
    names = ['minimal_publisher', 'minimal_subscriber']
    wait_for(lambda: [endpoint.node_name for endpoint in endpoints()] == names, 'both ends')
    for endpoint in endpoints():
        assert endpoint.node_namespace == '/'
        assert endpoint.topic_type == 'std_msgs/msg/String'
        assert endpoint.qos_profile.reliability is ReliabilityPolicy.RELIABLE

    assert child.stop() == 0
    said = child.matching('[minimal_publisher]')
    listened = child.matching('[minimal_subscriber]')
    assert said == [
        f'[INFO] [minimal_publisher]: Publishing: "Hello World: {n}"' for n in range(len(said))
    ]
    assert listened == [
        f'[INFO] [minimal_subscriber]: I heard: "Hello World: {n}"' for n in range(len(listened))
    ]
    first = int(heard[0].data.rpartition(' ')[2])
    assert [message.data for message in heard] == [
        f'Hello World: {n}' for n in range(first, first + len(heard))
    ]


def test_greeter_says_the_name_as_it_is_now_and_is_answered(up, peer, wait_for):
    heard = peer.listen(String, 'greeting')
    child = up('greeter')
    child.wait_for_line(
        '[INFO] [greeter_subscriber]: Hello Alice! This is the greeter bot.', times=2
    )
    wait_for(lambda: heard, 'a greeting')

    assert heard[0].data == 'Alice'
    assert child.lines[0].startswith('[INFO] [composer]: greeter: 2 nodes ready in ')
    change = Parameter('name', value='Bob').to_parameter_msg()
    peer.call(SetParameters, 'greeter_publisher/set_parameters', parameters=[change])
    child.wait_for_line('[INFO] [greeter_subscriber]: Hello Bob! This is the greeter bot.')
    wait_for(lambda: heard[-1].data == 'Bob', 'the new name')
    assert child.stop() == 0


def test_parameter_set_live_shows_in_the_next_line(up, peer):
    child = up('parameter')
    child.wait_for_line('[INFO] [minimal_param_node]: Hello world!')
    before = peer.call(
        GetParameters, 'minimal_param_node/get_parameters', names=['my_parameter']
    ).values
    change = Parameter('my_parameter', value='earth').to_parameter_msg()
    (result,) = peer.call(
        SetParameters, 'minimal_param_node/set_parameters', parameters=[change]
    ).results
    greetings_before = len(child.matching('Hello world!'))
    child.wait_for_line('[INFO] [minimal_param_node]: Hello earth!')

    assert before[0].type == ParameterType.PARAMETER_STRING
    assert before[0].string_value == 'world'
    assert (result.successful, result.reason) == (True, '')
    assert child.stop() == 0
    greetings = child.matching('Hello ')
    assert len(child.matching('Hello world!')) <= greetings_before + 1
    assert greetings == sorted(greetings, reverse=True), 'world came back after earth'


_LEVELS = {
    'DEBUG': 'This is a debug message.',
    'INFO': 'This is an info message.',
    'WARN': 'This is a warn message.',
    'ERROR': 'This is an error message.',
    'FATAL': 'This is a fatal message.',
}


@pytest.mark.parametrize(
    ('arguments', 'first'),
    [
        ((), 1),
        (('--log-level', 'logger_node:=error'), 3),
        (('--ros-args', '--log-level', 'logger_node:=debug'), 0),
    ],
)
def test_logging_shows_the_levels_that_are_asked_for(up, arguments, first):
    child = up('logging', *arguments)
    child.wait_for_line('This is a fatal message.')

    assert child.stop() == 0
    expected = [f'[{level}] [logger_node]: {text}' for level, text in _LEVELS.items()]
    assert child.matching('[logger_node]: This is') == expected[first:]


def test_a_source_publishes_the_lines_of_a_port(up):
    child = up('serial_line')
    child.wait_for_line('I heard: "$GPGLL,4916.45,N,12311.12,W"')
    assert child.stop() == 0, child.output
