"""Arrays in payloads, in the containers that people have them in."""

from array import array
from collections import deque
from itertools import product
from math import isnan

import pytest

pytest.importorskip('rclpy')

import numpy as np
from geometry_msgs.msg import PoseWithCovariance
from sensor_msgs.msg import CompressedImage, Image, JointState, LaserScan
from std_msgs.msg import ByteMultiArray, Float64MultiArray, Int8MultiArray
from test_msgs.msg import Arrays, BoundedSequences, UnboundedSequences

from tests.runtime.messages.test_payloads import convert, finding, received

pytestmark = pytest.mark.ros

NUMBERS = {
    'char': 'B',
    'int8': 'b',
    'uint8': 'B',
    'int16': 'h',
    'uint16': 'H',
    'int32': 'i',
    'uint32': 'I',
    'int64': 'q',
    'uint64': 'Q',
    'float32': 'f',
    'float64': 'd',
}
CONTAINERS = {
    'list': lambda items, _code: items,
    'tuple': lambda items, _code: tuple(items),
    'deque': lambda items, _code: deque(items),
    'array': lambda items, code: array(code, items),
    'numpy': np.array,
    'other dtype': lambda items, _code: np.array(items, '>i8'),
}
CLASSES = (Arrays, BoundedSequences, UnboundedSequences)


@pytest.mark.parametrize('container', CONTAINERS)
def test_numbers_arrive_from_any_container(container):
    items = [0, 1, 127]
    for message_class, (kind, code) in product(CLASSES, NUMBERS.items()):
        given = CONTAINERS[container](items, code)
        message = received(convert(message_class, {f'{kind}_values': given}))
        assert list(getattr(message, f'{kind}_values')) == items, (message_class, kind)


@pytest.mark.parametrize('message_class', CLASSES)
def test_all_else_arrives_as_well(message_class):
    payload = {
        'bool_values': np.array([True, False, True]),
        'byte_values': [0, b'\x01', 255],
        'string_values': ('a', 'b', 'ü'),
        'basic_types_values': ({'int8_value': 1}, {}, {'bool_value': True}),
    }
    message = received(convert(message_class, payload))
    assert list(message.bool_values) == [True, False, True]
    assert list(message.byte_values) == [b'\x00', b'\x01', b'\xff']
    assert list(message.string_values) == ['a', 'b', 'ü']
    assert [each.int8_value for each in message.basic_types_values] == [1, 0, 0]
    assert [each.bool_value for each in message.basic_types_values] == [False, False, True]


@pytest.mark.parametrize(
    'octets',
    [
        b'\x00\xff',
        array('B', [0, 255]),
        memoryview(b'\x00x\xffx')[::2],
        np.array([0, 255]),
    ],
)
def test_octets_arrive_from_whatever_holds_octets(octets):
    assert received(convert(CompressedImage, {'data': octets})).data.tobytes() == b'\x00\xff'
    assert received(convert(ByteMultiArray, {'data': octets})).data == [b'\x00', b'\xff']
    assert convert(Arrays, {'uint8_values': b'abc'}).uint8_values.tolist() == [97, 98, 99]


@pytest.mark.parametrize(
    ('given', 'got'),
    [
        (b'\x01', "bytes b'\\x01'"),
        ('a', "str 'a'"),
        (np.array(5), 'int 5'),
        (None, 'None'),
    ],
)
def test_what_holds_no_array_is_refused(given, got):
    assert finding(Int8MultiArray, {'data': given}) == (
        f'std_msgs/msg/Int8MultiArray: data: expected int8[], got {got}'
    )


def test_a_matrix_is_laid_out_row_by_row():
    matrix = np.arange(36.0).reshape(6, 6)
    row_by_row = list(range(36))
    message = received(convert(PoseWithCovariance, {'covariance': matrix}))
    assert message.covariance.tolist() == row_by_row
    turned = received(convert(PoseWithCovariance, {'covariance': matrix.T}))
    assert turned.covariance.tolist() == matrix.T.ravel().tolist()
    pixels = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)[:, :, ::-1]
    image = received(convert(Image, {'data': pixels}))
    assert image.data.tolist() == pixels.ravel().tolist()
    bools = np.array([[True, False, True]])
    assert convert(Arrays, {'bool_values': bools}).bool_values == [True, False, True]


def test_nested_lists_are_no_matrix():
    assert finding(Float64MultiArray, {'data': [[1.0], [2.0]]}) == (
        'std_msgs/msg/Float64MultiArray: data[0]: expected float64, got list [1.0]'
    )


def test_empty_arrays_have_no_items_of_a_wrong_type():
    for empty in ([], (), np.array([]), np.zeros((0, 3)), np.array([], bool)):
        assert convert(Int8MultiArray, {'data': empty}).data.tolist() == []


@pytest.mark.parametrize(
    ('name', 'given', 'expected'),
    [
        ('int8', [0, 1, 128], '[2]: expected int8 (-128 to 127), got int 128'),
        ('uint8', [0, -1, 1], '[1]: expected uint8 (0 to 255), got int -1'),
        ('int8', [0, True, 1], '[1]: expected int8, got bool True'),
        ('uint8', np.array([0, -1, 1]), '[1]: expected uint8 (0 to 255), got int -1'),
        ('int8', np.array([0.0, 1.0, 1.0]), '[0]: expected int8, got float 0.0'),
        ('float64', np.array([True, False, True]), '[0]: expected float64, got bool True'),
        ('float64', [0.0, 1, 10**400], '[2]: expected float64, got an integer beyond its range'),
        (
            'float32',
            np.array([0, 1e39, 1]),
            '[1]: expected float32 (up to 3.402823e+38), got float 1e+39',
        ),
        ('bool', [True, 1, True], '[1]: expected bool, got int 1'),
        (
            'basic_types',
            [{}, {'int8_value': 300}, {}],
            '[1].int8_value: expected int8 (-128 to 127), got int 300',
        ),
    ],
)
def test_the_first_wrong_item_is_named(name, given, expected):
    for message_class in CLASSES:
        assert finding(message_class, {f'{name}_values': given}) == (
            f'test_msgs/msg/{message_class.__name__}: {name}_values{expected}'
        )


@pytest.mark.parametrize('name', ['bool', 'float32', 'string'])
@pytest.mark.parametrize('container', [list, np.array])
def test_the_number_of_items_is_checked(name, container):
    item = {'bool': True, 'string': 'a'}.get(name, 1)
    for message_class, length, bound in [
        (Arrays, 2, '[3]'),
        (Arrays, 4, '[3]'),
        (BoundedSequences, 4, '[<=3]'),
    ]:
        assert finding(message_class, {f'{name}_values': container([item] * length)}) == (
            f'test_msgs/msg/{message_class.__name__}: {name}_values: '
            f'expected {name}{bound}, got {length} items'
        )
    shorter = convert(BoundedSequences, {f'{name}_values': container([item])})
    assert len(getattr(shorter, f'{name}_values')) == 1


def test_infinities_and_nan_are_kept():
    for given in ([float('inf'), float('nan'), 1], np.array([np.inf, np.nan, 1])):
        ranges = received(convert(LaserScan, {'ranges': given})).ranges
        assert ranges[0] == float('inf')
        assert isnan(ranges[1])
        assert ranges[2] == 1.0


def test_numbers_of_a_message_stay_the_same_object():
    image = Image(data=b'abc')
    data = image.data
    assert convert(Image, image).data is data
    pose = PoseWithCovariance()
    covariance = pose.covariance
    assert convert(PoseWithCovariance, pose).covariance is covariance
    names = ['a', 'b']
    state = JointState(name=names)
    assert convert(JointState, state).name is names


def test_what_grew_in_a_message_is_checked():
    message = BoundedSequences()
    message.int8_values.append(1)
    message.bool_values = [True] * 4
    assert finding(BoundedSequences, message) == (
        'test_msgs/msg/BoundedSequences: bool_values: expected bool[<=3], got 4 items'
    )
    message.bool_values = []
    message.int8_values.extend([1, 2, 3, 4])
    assert finding(BoundedSequences, message) == (
        f'test_msgs/msg/BoundedSequences: int8_values: expected int8[<=3], '
        f'got {len(message.int8_values)} items'
    )


def test_a_matrix_in_a_message_is_laid_out_before_rclpy_reads_beyond_it():
    pose = PoseWithCovariance()
    pose.covariance = np.arange(36.0).reshape(6, 6)
    assert convert(PoseWithCovariance, pose) is pose
    assert pose.covariance.shape == (36,)
    assert received(pose).covariance.tolist() == list(range(36))
    pose.covariance = np.zeros(9)
    assert finding(PoseWithCovariance, pose) == (
        'geometry_msgs/msg/PoseWithCovariance: covariance: expected float64[36], got 9 items'
    )


def test_octets_in_a_message_are_brought_into_the_form_that_subscribers_see():
    message = ByteMultiArray(data=b'ab')
    assert convert(ByteMultiArray, message).data == [b'a', b'b']
    fixed = Arrays(byte_values=[1, 2, 3])
    convert(Arrays, fixed)
    assert received(fixed).byte_values == [b'\x01', b'\x02', b'\x03']
