"""Write protection of the NumPy arrays in messages."""

import pytest

pytest.importorskip('rclpy')

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image, MultiDOFJointState
from std_msgs.msg import String
from test_msgs.msg import Arrays, MultiNested, UnboundedSequences

from composer.runtime.messages.read_only import protector_for

pytestmark = pytest.mark.ros


def find_arrays(value):
    """Yield all NumPy arrays in a message."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, list):
        for each in value:
            yield from find_arrays(each)
    elif hasattr(value, 'SLOT_TYPES'):
        for name in value.get_fields_and_field_types():
            yield from find_arrays(getattr(value, name))


@pytest.mark.parametrize('message_class', [CameraInfo, Arrays, PoseWithCovarianceStamped])
def test_all_numpy_arrays_are_protected(message_class):
    message = message_class()
    protector_for(message_class)(message)
    arrays = list(find_arrays(message))
    assert arrays
    for each in arrays:
        with pytest.raises(ValueError, match='read-only'):
            each[0] = 0


def test_arrays_in_lists_of_messages_are_protected():
    message = MultiNested()
    message.unbounded_sequence_of_arrays = [Arrays(), Arrays()]
    protector_for(MultiNested)(message)
    arrays = list(find_arrays(message.unbounded_sequence_of_arrays))
    assert len(arrays) > 2
    assert not any(each.flags.writeable for each in find_arrays(message))


@pytest.mark.parametrize('message_class', [String, Image, UnboundedSequences, MultiDOFJointState])
def test_there_is_nothing_to_do_without_numpy_arrays(message_class):
    assert not list(find_arrays(message_class()))
    assert protector_for(message_class) is None
