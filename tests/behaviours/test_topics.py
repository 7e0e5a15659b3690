"""Behaviours between topics, given messages one by one."""

import pytest

pytest.importorskip('rclpy')

from geometry_msgs.msg import Twist, TwistStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64, Int32, String

from behaviours.topics import TransformError, drop, mux, relay, throttle, transform
from composer.runtime.messages.payloads import converter_for

pytestmark = pytest.mark.ros


def passed_by_throttle(behaviour_node, set_time, times, rate):
    passed = []
    for time in times:
        set_time(time)
        if throttle(behaviour_node, Int32(), rate=rate) is not None:
            passed.append(time)
    return passed


def test_relay_passes_on_the_message_itself(behaviour_node):
    message = String(data='x')
    assert relay(behaviour_node, message) is message


@pytest.mark.parametrize(('rate', 'expected'), [(1.0, 10), (3.0, 30), (7.0, 70), (50.0, 100)])
def test_throttle_passes_on_its_rate_exactly_or_all_that_comes(
    behaviour_node, set_time, rate, expected
):
    times = [100 + n / 10 for n in range(100)]
    assert len(passed_by_throttle(behaviour_node, set_time, times, rate)) == expected


def test_throttle_passes_on_the_first_message_after_a_pause_and_no_burst(behaviour_node, set_time):
    times = [1.0, 1.1, 9.0, 9.1, 9.2, 10.0]
    assert passed_by_throttle(behaviour_node, set_time, times, rate=1.0) == [1.0, 9.0, 10.0]


def test_throttle_goes_on_when_simulated_time_begins_again(behaviour_node, set_time):
    times = [100.0, 100.5, 2.0, 2.5, 3.0]
    assert passed_by_throttle(behaviour_node, set_time, times, rate=1.0) == [100.0, 2.0, 3.0]


def test_drop_drops_the_first_of_each_few_messages(behaviour_node):
    messages = [Int32(data=n) for n in range(9)]
    passed = [drop(behaviour_node, message, count=2, of=3) for message in messages]
    assert [message.data for message in passed if message] == [2, 5, 8]


def test_mux_passes_on_the_source_that_is_selected_now(behaviour_node):
    behaviour_node.ros.declare_parameter('selected', 'left')
    assert mux(behaviour_node, Int32(data=1), source='left').data == 1
    assert mux(behaviour_node, Int32(data=2), source='right') is None
    behaviour_node.ros.set_parameters([Parameter('selected', value='right')])
    assert mux(behaviour_node, Int32(data=3), source='left') is None
    assert mux(behaviour_node, Int32(data=4), source='right').data == 4


def test_transform_computes_nested_fields_of_another_type(behaviour_node):
    fields = {'header.frame_id': "'base'", 'twist.linear.x': 'data / 3.6', 'twist.angular.z': 1}
    message = converter_for(TwistStamped).convert(
        transform(behaviour_node, Float64(data=36.0), fields)
    )
    assert message.header.frame_id == 'base'
    assert (message.twist.linear.x, message.twist.angular.z) == (10.0, 1.0)
    assert message.twist.linear.y == 0.0


def test_transform_knows_arrays_and_the_message_itself(behaviour_node):
    scan = LaserScan(ranges=[3.0, 0.5, 2.0])
    assert transform(behaviour_node, scan, {'data': 'ranges | min'}) == {'data': 0.5}
    assert transform(behaviour_node, scan, {'data': 'ranges[2] > 1'}) == {'data': True}
    twist = Twist()
    assert transform(behaviour_node, twist, {'twist': 'message'}) == {'twist': twist}


@pytest.mark.parametrize(
    ('expression', 'reason'),
    [
        ('dta', "'dta' is undefined"),
        ('data.nothing', "has no attribute 'nothing'"),
        ('data +', 'unexpected'),
        ('1 / data', 'division by zero'),
        ('message.__class__', 'unsafe'),
        ('message.get_fields_and_field_types()', 'unsafe'),
    ],
)
def test_transform_says_why_a_field_has_no_value(behaviour_node, expression, reason):
    with pytest.raises(TransformError) as raised:
        transform(behaviour_node, Float64(), {'linear.x': expression})
    text = str(raised.value)
    assert text.startswith(f"cannot evaluate '{expression}' for 'linear.x': ")
    assert reason in text
    assert raised.value.help == 'expressions can use message, data'
