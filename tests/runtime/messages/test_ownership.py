"""Messages that are handed over are those that the middleware would give, and belong to nobody."""

import struct
from array import array
from weakref import ref

import numpy as np
import pytest
from geometry_msgs.msg import Pose, PoseArray, PoseWithCovariance
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import Byte, Float32, Float64, Int32, String
from test_msgs.msg import Arrays, BasicTypes, BoundedSequences, UnboundedSequences, WStrings

from composer.interfaces.class_fields import describe_class
from composer.interfaces.classes import import_interface
from composer.interfaces.field_values import INTEGER_RANGES
from composer.runtime.messages.ownership import ownership_of
from composer.runtime.messages.payloads import converter_for

pytestmark = pytest.mark.ros


class Text(str):
    """A text of another class."""

    __slots__ = ()


class Number(int):
    """A number of another class."""


class List(list):
    """A list of another class."""


class DerivedPose(Pose):
    """A message of another class."""


PAYLOADS = [
    (Int32, Number(4)),
    (Float64, 1),
    (Float64, np.float32(0.1)),
    (Float32, np.float64(0.1)),
    (String, Text('text')),
    (Byte, bytearray(b'b')),
    (WStrings, {'array_of_wstrings': ('a', 'b', Text('c'))}),
    (UnboundedSequences, {'string_values': List(['a'])}),
    (UnboundedSequences, {'basic_types_values': (BasicTypes(float32_value=0.1),)}),
    (Arrays, {'float64_values': np.zeros(6)[::2], 'bool_values': np.ones(3, bool)}),
    (BoundedSequences, {'float64_values': (1, 2)}),
    (PoseWithCovariance, {'covariance': np.zeros((6, 6)).T, 'pose': DerivedPose()}),
    (PoseArray, {'poses': [DerivedPose(), Pose()]}),
]


def test_what_arrives_is_what_the_middleware_would_give():
    for message_class, payload in PAYLOADS:
        message = converter_for(message_class).convert(payload)
        sent = deserialize_message(serialize_message(message), message_class)
        taken = ownership_of(message_class).take(message, is_held=False)
        assert differences(taken, sent) == [], payload


NUMBERS = st.floats(width=32) | st.integers(0, 100).map(float)
SCALARS = {
    'bool': st.booleans(),
    'byte': st.binary(min_size=1, max_size=1),
    'float32': NUMBERS,
    'float64': st.floats() | NUMBERS,
    'string': st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs'])),
    'wstring': st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0')),
} | {
    kind: st.integers(low, high) for kind, (low, high) in INTEGER_RANGES.items() if kind != 'byte'
}
CLASSES = [Arrays, BasicTypes, BoundedSequences, UnboundedSequences, PoseArray, PointCloud2]


def fields(field_type):
    if field_type.array is not None:
        bound = 3 if field_type.array_bound is None else min(3, field_type.array_bound)
        least = field_type.array_bound if field_type.array == 'fixed' else 0
        return st.lists(fields(field_type.item), min_size=least, max_size=max(least, bound))
    if field_type.nested is not None:
        return messages(import_interface(field_type.nested))
    return SCALARS[field_type.kind]


def messages(message_class):
    types = {each.name: each.type for each in describe_class(message_class).fields}
    chosen = {name: fields(field_type) for name, field_type in types.items()}
    return st.fixed_dictionaries({}, optional=chosen)


@given(data=st.data())
def test_any_message_arrives_as_by_the_middleware_and_shares_nothing(data):
    message_class = data.draw(st.sampled_from(CLASSES))
    message = converter_for(message_class).convert(data.draw(messages(message_class)))
    sent = deserialize_message(serialize_message(message), message_class)
    kept = data.draw(st.sets(st.sampled_from(sorted(changeable(message)))))
    held = [part for path, part in changeable(message).items() if path in kept]
    ids = {id(part) for part in held}
    copy = ownership_of(message_class).copy(message)
    assert not {id(part) for part in changeable(copy).values()} & {
        id(part) for part in changeable(message).values()
    }
    assert differences(copy, sent) == []
    taken = ownership_of(message_class).take(message, is_held=id(message) in ids)
    assert not {id(part) for part in changeable(taken).values()} & ids
    assert differences(taken, sent) == []


def test_what_nobody_holds_is_moved():
    cloud = PointCloud2(fields=[PointField(name='x'), PointField(name='y')], data=bytes(1000))
    ids = {path: id(part) for path, part in changeable(cloud).items()}
    held = cloud.fields[1]
    taken = ownership_of(PointCloud2).take(cloud, is_held=False)
    moved = {path for path, part in changeable(taken).items() if id(part) == ids[path]}
    assert ids.keys() - moved == {'.fields[1]'}
    assert held.name == 'y'


def test_a_field_that_shows_the_memory_of_another_array_is_copied():
    matrix = np.zeros((2, 36))
    message = PoseWithCovariance()
    message._covariance = matrix[1]
    taken = ownership_of(PoseWithCovariance).take(message, is_held=False)
    matrix[1] = 1
    assert not taken.covariance.any()


def test_an_array_that_subscriptions_share_is_copied_for_others():
    message = PoseWithCovariance()
    message.covariance.setflags(write=False)
    taken = ownership_of(PoseWithCovariance).take(message, is_held=False)
    assert taken.covariance.flags.writeable


@pytest.mark.parametrize(
    ('message', 'name'), [(PoseWithCovariance(), 'covariance'), (JointState(), 'position')]
)
def test_an_array_with_a_weak_reference_is_copied(message, name):
    weak = ref(getattr(message, name))
    taken = ownership_of(type(message)).take(message, is_held=False)
    assert weak() is not getattr(taken, name)


def changeable(value, path=''):
    """Return all inside a message that can change, by its path."""
    found = {}
    if hasattr(value, 'get_fields_and_field_types'):
        found[path] = value
        for name in value.get_fields_and_field_types():
            found |= changeable(getattr(value, name), f'{path}.{name}')
    elif isinstance(value, list):
        found[path] = value
        for index in range(len(value)):
            found |= changeable(value[index], f'{path}[{index}]')
    elif isinstance(value, array | np.ndarray):
        found[path] = value
    return found


def differences(ours, theirs, path=''):
    """Return where two messages differ, in value or in class."""
    if type(ours) is not type(theirs):
        return [f'{path}: {type(ours)}, {type(theirs)}']
    if hasattr(ours, 'get_fields_and_field_types'):
        names = ours.get_fields_and_field_types()
        pairs = [(getattr(ours, each), getattr(theirs, each), f'.{each}') for each in names]
    elif isinstance(ours, list) and len(ours) == len(theirs):
        pairs = [(*pair, f'[{at}]') for at, pair in enumerate(zip(ours, theirs, strict=True))]
    elif isinstance(ours, np.ndarray):
        same = (ours.dtype, ours.shape, ours.tobytes()) == (
            theirs.dtype,
            theirs.shape,
            theirs.tobytes(),
        )
        return [] if same else [path]
    elif isinstance(ours, array):
        same = (ours.typecode, ours.tobytes()) == (theirs.typecode, theirs.tobytes())
        return [] if same else [path]
    elif isinstance(ours, float):
        return [] if struct.pack('d', ours) == struct.pack('d', theirs) else [path]
    else:
        return [] if ours == theirs else [f'{path}: {ours!r}, {theirs!r}']
    return [each for mine, other, step in pairs for each in differences(mine, other, path + step)]
