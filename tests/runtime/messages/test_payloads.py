"""Payloads become messages; each test that converts also shows what a subscriber would get."""

import weakref
from array import array
from collections import UserDict

import pytest

pytest.importorskip('rclpy')

from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32, Polygon, PoseStamped, Twist, Vector3
from rclpy.duration import Duration as RclpyDuration
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time as RclpyTime
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Bool, Byte, Char, Empty, Float64, Header, Int32, String
from std_srvs.srv import Trigger
from test_msgs.action import NestedMessage
from test_msgs.message_fixtures import get_test_msg
from test_msgs.msg import BasicTypes, Builtins, Nested, Strings, WStrings
from visualization_msgs.msg import Marker

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.runtime.messages.payloads import PayloadError, converter_for

pytestmark = pytest.mark.ros


def convert(message_class, payload):
    return converter_for(message_class).convert(payload)


def received(message):
    return deserialize_message(serialize_message(message), type(message))


def failure(message_class, payload):
    """Return the message and the help of the error."""
    with pytest.raises(PayloadError) as caught:
        convert(message_class, payload)
    # Where nobody hears it, nothing is built, and the same errors are found.
    with pytest.raises(PayloadError) as checked:
        converter_for(message_class, builds=False).convert(payload)
    assert (str(checked.value), checked.value.help) == (str(caught.value), caught.value.help)
    return str(caught.value), caught.value.help


def finding(message_class, payload):
    return failure(message_class, payload)[0]


@pytest.mark.parametrize(
    ('message_class', 'payload', 'data'),
    [
        (String, 'hello', 'hello'),
        (Bool, True, True),
        (Int32, -5, -5),
        (Float64, 2, 2.0),
        (Byte, 7, b'\x07'),
        (Char, 7, 7),
    ],
)
def test_a_bare_value_is_the_one_field(message_class, payload, data):
    message = received(convert(message_class, payload))
    assert type(message) is message_class
    assert message.data == data
    assert type(message.data) is type(data)


@pytest.mark.parametrize('mapping', [dict, UserDict])
def test_a_mapping_names_fields_and_leaves_the_rest_at_their_defaults(mapping):
    message = received(convert(Twist, mapping({'linear': mapping(x=1, z=0.5)})))
    assert message == Twist(linear=Vector3(x=1.0, y=0.0, z=0.5))


def test_nested_messages_are_given_in_all_three_ways():
    status = convert(
        DiagnosticStatus,
        {
            'level': 1,
            'values': [KeyValue(key='a', value='1'), {'key': 'b'}],
        },
    )
    assert received(status) == DiagnosticStatus(
        level=b'\x01',
        values=[KeyValue(key='a', value='1'), KeyValue(key='b')],
    )
    nested = convert(NestedMessage.Goal, {'nested_field_no_pkg': {'duration_value': {'sec': 3}}})
    assert nested.nested_field_no_pkg.duration_value == Duration(sec=3)
    assert convert(Nested, BasicTypes(int32_value=5)) == (
        convert(Nested, {'basic_types_value': {'int32_value': 5}})
    )


def test_a_bare_list_is_the_one_array():
    polygon = received(convert(Polygon, [{'x': 1}, Point32(y=2.0)]))
    assert polygon == Polygon(points=[Point32(x=1.0), Point32(y=2.0)])


@pytest.mark.parametrize('payload', [{}, None])
def test_an_empty_message_is_an_empty_mapping_or_none(payload):
    assert convert(Trigger.Request, payload) == Trigger.Request()


def test_the_times_of_rclpy_stand_for_their_messages():
    stamp = RclpyTime(seconds=5, nanoseconds=7)
    assert convert(Time, stamp) == Time(sec=5, nanosec=7)
    assert convert(Header, {'stamp': stamp}) == Header(stamp=Time(sec=5, nanosec=7))
    lifetime = RclpyDuration(nanoseconds=-1)
    assert convert(Marker, {'lifetime': lifetime}).lifetime == Duration(sec=-1, nanosec=999999999)
    assert failure(Marker, {'lifetime': stamp}) == (
        (
            'visualization_msgs/msg/Marker: lifetime: expected builtin_interfaces/msg/Duration, '
            'got builtin_interfaces/msg/Time'
        ),
        'give its fields by name: sec, nanosec',
    )


def test_a_message_is_returned_itself():
    twist = Twist(linear=Vector3(x=1.0))
    linear = twist.linear
    assert convert(Twist, twist) is twist
    assert twist.linear is linear
    given = {'linear': linear}
    assert convert(Twist, given).linear is linear


def test_a_right_message_of_any_type_is_not_changed():
    names = list(InterfaceCatalogue().names('msg', 'test_msgs'))
    assert 'test_msgs/msg/Arrays' in names
    for name in names:
        messages, originals = (get_test_msg(name.rpartition('/')[2]) for _ in range(2))
        assert messages
        for message, original in zip(messages, originals, strict=True):
            fields = {
                each: getattr(message, each) for each in message.get_fields_and_field_types()
            }
            assert convert(type(message), message) is message
            assert message == original
            for field, value in fields.items():
                assert getattr(message, field) is value, (name, field)


def test_what_a_message_holds_in_another_form_is_replaced_in_place():
    number = Float64(data=5)
    assert received(number).data != 5.0  # What rclpy does with an int in a float64 field.
    assert convert(Float64, number) is number
    assert type(number.data) is float
    assert received(number).data == 5.0

    pose = PoseStamped()
    pose.pose.position.x = 1
    assert convert(PoseStamped, pose) is pose
    assert received(pose).pose.position.x == 1.0

    status = DiagnosticStatus(values=(KeyValue(key='a'),))
    convert(DiagnosticStatus, status)
    assert type(status.values) is list


@pytest.mark.parametrize(
    ('message', 'finding'),
    [
        (String(data=5), 'std_msgs/msg/String: data: expected string, got int 5'),
        (
            Int32(data=2**31),
            (
                'std_msgs/msg/Int32: data: expected int32 (-2147483648 to '
                '2147483647), got int 2147483648'
            ),
        ),
        (
            Polygon(points=[Point32(), Point32(z=None)]),
            'geometry_msgs/msg/Polygon: points[1].z: expected float32, got None',
        ),
    ],
)
def test_a_wrong_message_is_refused_before_rclpy_trusts_it(message, finding):
    assert failure(type(message), message)[0] == finding


@pytest.mark.parametrize(
    ('message_class', 'payload', 'finding', 'advice'),
    [
        (
            Twist,
            {'liner': {}},
            "geometry_msgs/msg/Twist has no field 'liner'",
            "did you mean 'linear'? its fields are linear, angular",
        ),
        (
            Twist,
            {'linear': [1, 2, 3]},
            (
                'geometry_msgs/msg/Twist: linear: expected geometry_msgs/msg/Vector3, '
                'got list [1, 2, 3]'
            ),
            'give its fields by name: x, y, z',
        ),
        (
            Twist,
            Vector3(),
            'expected geometry_msgs/msg/Twist, got geometry_msgs/msg/Vector3',
            'give its fields by name: linear, angular',
        ),
        (Empty, 0, 'expected std_msgs/msg/Empty, got int 0', 'it has no fields: write {}'),
        (
            Polygon,
            [{'x': 1}, {'x': True}],
            'geometry_msgs/msg/Polygon: points[1].x: expected float32, got bool True',
            None,
        ),
        (
            Strings,
            {'bounded_string_value': 'x' * 23},
            'test_msgs/msg/Strings: bounded_string_value: expected string<=22, got text of 23 bytes',
            None,
        ),
    ],
)
def test_a_finding_names_message_field_and_both_types(message_class, payload, finding, advice):
    assert failure(message_class, payload) == (finding, advice)


def test_an_error_carries_type_and_path_for_programs():
    with pytest.raises(PayloadError) as caught:
        convert(Polygon, [{}, {'x': True}])
    assert caught.value.type_name == 'geometry_msgs/msg/Polygon'
    assert caught.value.path == ('points', 1, 'x')


def test_text_arrives_as_it_was_given():
    text = 'Hellö wörld! ハロー 😀'
    assert received(convert(String, text)).data == text
    wide = received(
        convert(
            WStrings,
            {
                'wstring_value': 'a\0😀',
                'array_of_wstrings': ('ü', '', 'ハ'),
            },
        )
    )
    assert wide.wstring_value == 'a\0😀'
    assert list(wide.array_of_wstrings) == ['ü', '', 'ハ']


def test_a_converter_is_compiled_once():
    assert converter_for(Builtins) is converter_for(Builtins)
    assert converter_for(Builtins) is not converter_for(Twist)


def test_what_nobody_hears_is_let_go():
    data = array('B', bytes(100))
    rest = weakref.ref(data)
    converter_for(CompressedImage, builds=False).convert({'data': data})
    del data
    assert rest() is None
