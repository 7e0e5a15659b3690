"""Write protection of the arrays of numbers in messages."""

import copy
import pickle
from array import array

import pytest

pytest.importorskip('rclpy')

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, Image, JointState, MultiDOFJointState
from std_msgs.msg import String
from test_msgs.msg import Arrays, BoundedSequences, MultiNested, UnboundedSequences

from composer.runtime.messages.ownership import ownership_of
from composer.runtime.messages.payloads import converter_for
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


@pytest.mark.parametrize('message_class', [String, MultiDOFJointState])
def test_there_is_nothing_to_do_without_arrays_of_numbers(message_class):
    assert protector_for(message_class) is None


SEQUENCES = (Image, JointState, BoundedSequences)
WRITES = {
    'item': lambda values: values.__setitem__(0, values[0]),
    'numpy.frombuffer': lambda values: np.frombuffer(values, 'B').__setitem__(0, 1),
    'numpy.asarray': lambda values: np.asarray(values).__setitem__(0, 1),
    'append': lambda values: values.append(1),
    'extend': lambda values: values.extend([1]),
    'delete': lambda values: values.__delitem__(0),
    'frombytes': lambda values: values.frombytes(bytes(8)),
}


def find_sequences(value):
    """Yield messages with the names of their sequences of numbers."""
    if isinstance(value, list):
        for each in value:
            yield from find_sequences(each)
    for name in getattr(value, '_fields_and_field_types', ()):
        if type(getattr(value, f'_{name}')) is array:
            yield value, name
        yield from find_sequences(getattr(value, name))


def make_pair(message_class):
    """Return a message with numbers in its sequences, and another one that is protected."""
    message = message_class()
    for inner, name in find_sequences(message):
        setattr(inner, name, [1, 2, 3])
    protected = copy.deepcopy(message)
    protector_for(message_class)(protected)
    return message, protected


@pytest.mark.parametrize('write', WRITES.values(), ids=WRITES)
def test_sequences_of_numbers_are_protected(write):
    for message_class in SEQUENCES:
        plain, protected = make_pair(message_class)
        found = list(find_sequences(protected))
        assert found
        for message, name in found:
            with pytest.raises((TypeError, ValueError, AttributeError)):
                write(getattr(message, name))
        assert protected == plain


@pytest.mark.parametrize('message_class', SEQUENCES)
def test_fields_are_assigned_and_messages_made_as_ever(message_class):
    _plain, protected = make_pair(message_class)
    made = type(protected)()
    assert type(made) is message_class
    for message, name in find_sequences(protected):
        setattr(message, name, [4, 5])
        assert getattr(message, name).tolist() == [4, 5]
        assert type(getattr(message, name)) is memoryview
        with pytest.raises((AssertionError, TypeError)):
            setattr(message, name, 'text')
    for message, name in find_sequences(made):
        assert type(getattr(message, name)) is array


@pytest.mark.parametrize('message_class', [*SEQUENCES, Arrays])
def test_who_only_reads_sees_no_difference(message_class):
    plain, protected = make_pair(message_class)
    assert repr(protected) == repr(plain)
    assert protected == plain
    assert plain == protected
    assert protected == make_pair(message_class)[1]
    assert not protected != plain  # noqa: SIM202
    assert protected != String()
    assert isinstance(protected, message_class)
    assert deserialize_message(serialize_message(protected), message_class) == plain
    for (message, name), (other, _) in zip(
        find_sequences(protected), find_sequences(plain), strict=True
    ):
        view, values = getattr(message, name), getattr(other, name)
        assert view == values
        assert view[1:] == values[1:]
        assert list(view) == view.tolist() == values.tolist()
        assert len(view) == len(values)
        assert view[-1] == values[-1]
        assert bytes(view) == view.tobytes() == values.tobytes()
        assert array(values.typecode, view) == values
        assert np.array_equal(np.asarray(view), np.asarray(values))
        setattr(other, name, view)
        assert type(getattr(other, name)) is array
        assert type(copy.deepcopy(view)) is array


COPIES = {
    'deepcopy': copy.deepcopy,
    'copy': copy.copy,
    'pickle': lambda message: pickle.loads(pickle.dumps(message)),
    'published': lambda message: converter_for(type(message).__mro__[1]).convert(message),
    'handed over': lambda message: ownership_of(type(message).__mro__[1]).take(
        message, is_held=False
    ),
    'published in parts': lambda message: converter_for(type(message).__mro__[1]).convert(
        {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    ),
}


@pytest.mark.parametrize('make', COPIES.values(), ids=COPIES)
def test_copies_may_be_written(make):
    for message_class in SEQUENCES:
        plain, protected = make_pair(message_class)
        copied = make(protected)
        assert type(copied) is message_class
        assert copied == plain
        for message, name in find_sequences(copied):
            getattr(message, name)[0] = 7
        assert copied != plain
        assert protected == plain


def test_sequences_in_lists_of_messages_are_protected():
    message = MultiNested()
    message.unbounded_sequence_of_unbounded_sequences = [UnboundedSequences()]
    message.unbounded_sequence_of_unbounded_sequences[0].int32_values = [1, 2]
    plain = copy.deepcopy(message)
    protector_for(MultiNested)(message)
    with pytest.raises(TypeError):
        message.unbounded_sequence_of_unbounded_sequences[0].int32_values[0] = 3
    assert message == plain
    # Bytes between fields may differ.
    assert deserialize_message(serialize_message(message), MultiNested) == plain
    copied = copy.deepcopy(message)
    copied.unbounded_sequence_of_unbounded_sequences[0].int32_values[0] = 3
    assert message == plain
