"""Messages are serialized as rclpy has them serialized."""

import pytest

pytest.importorskip('rclpy')

from rclpy.serialization import deserialize_message, serialize_message

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.classes import import_interface
from composer.recordings.cdr import serializer_of
from tests.recorded import filled

pytestmark = pytest.mark.ros


def test_every_type_is_serialized_as_by_rclpy():
    for name in InterfaceCatalogue().names('msg'):
        message_class = import_interface(name)
        for message in (message_class(), filled(message_class)):
            ours = serializer_of(message_class)(message)
            theirs = serialize_message(message)
            # Theirs may have a gap at the end, and has anything in gaps.
            assert len(ours) <= len(theirs) < len(ours) + 4, name
            assert repr(deserialize_message(ours, message_class)) == repr(message), name


@pytest.mark.parametrize(
    ('type_name', 'name', 'value'),
    [
        ('std_msgs/msg/String', 'data', 'a\0b'),
        ('std_msgs/msg/String', 'data', '\ud800'),
        ('test_msgs/msg/BasicTypes', 'int32_value', 1 << 40),
        ('test_msgs/msg/BasicTypes', 'float32_value', 1e300),
    ],
)
def test_what_does_not_fit_is_left_to_rclpy(type_name, name, value):
    message_class = import_interface(type_name)
    message = message_class()
    setattr(message, f'_{name}', value)
    outcomes = []
    for serialize in (serializer_of(message_class), serialize_message):
        try:
            outcomes.append(repr(deserialize_message(serialize(message), message_class)))
        except UnicodeEncodeError as error:
            outcomes.append(repr(error))
    assert outcomes[0] == outcomes[1]
