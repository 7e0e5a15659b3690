"""Behaviours that try to see each other's changes; `test_nobody_sees_changes.py` runs them.

Each case publishes a message when it hears one of the topic `go`, and keeps what it can of it. When
all messages have arrived, `judge` changes what was kept and looks for whom else it has changed.
"""

import copy
import ctypes
import threading
import weakref
from array import array
from collections import defaultdict
from functools import cache, partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import Image, Imu, JointState
from std_msgs.msg import Header
from test_msgs.msg import Arrays, BasicTypes, MultiNested, UnboundedSequences

# Who subscribes to the messages of a case; one alone gets the message itself.
AUDIENCES = (('keep',), ('keep', 'write', 'read', 'read_on', 'write_relayed'))
CASES = {}
SENT = defaultdict(list)
SEEN = defaultdict(list)
LATER = []
HELD = []
FOUND = []
EMPTY = np.frombuffer(b'')


def case(message_class):
    def add(function):
        CASES[function.__name__] = message_class
        return function

    return add


def send(node, message):
    """Note what is published."""
    SENT[node.name].append(repr(message))
    return message


def hold(value):
    """Note what must stay as it is, though subscriptions change what they get."""
    HELD.append((value, repr(value)))
    return value


def later(*values):
    """Change these when all messages have arrived."""
    LATER.extend(partial(change, value) for value in values)


def begin(number):
    """A message of each field that can change."""
    return JointState(header=Header(frame_id='base'), name=['a', 'b'], position=[number, 2.0])


def change(value):
    """Change all that there is in a value."""
    if hasattr(value, 'SLOT_TYPES'):
        for name in type(value).get_fields_and_field_types():
            part = getattr(value, name)
            change(part)
            if isinstance(part, str | float):
                object.__setattr__(value, name, type(part)(7))
    elif isinstance(value, np.ndarray):
        value.fill(7)
    elif isinstance(value, list):
        for part in value:
            change(part)
        value.reverse()
        value.extend(value[:1])
    elif isinstance(value, array) and value:
        value[0] = type(value[0])(7)
        value.append(value[0])


# Those who get the messages.


def keep(node, message):
    SEEN[node.name, 'keep'].append((repr(message), message))


def write(node, message):
    SEEN[node.name, 'write'].append((repr(message), None))
    change(message)


def read(node, message):
    SEEN[node.name, 'read'].append((repr(message), message))
    FOUND.extend(f'{node.name} may write to {name}' for name in find_writable(message))


def find_writable(message):
    names = type(message).get_fields_and_field_types()
    arrays = {name: getattr(message, name) for name in names}
    return [name for name, each in arrays.items() if getattr(each, 'flags', EMPTY.flags).writeable]


def read_on(node, message):
    """Relay a message that is shared."""
    SEEN[node.name, 'read_on'].append((repr(message), message))
    return message


def write_relayed(node, message):
    SEEN[node.name, 'write_relayed'].append((repr(message), None))
    change(message)


def conduct(node):
    """Let each case run thrice, and say who has seen what they must not."""
    for number in (1.0, 2.0, 3.0):
        yield number
        while not has_arrived(int(number)):
            yield None
    for action in LATER:
        action()
    node.logger.info(f'found {judge()}')


def has_arrived(rounds):
    """Tell whether the messages of so many rounds have all come."""
    sent = list(SENT.items())
    has_begun = sum(len(contents) >= rounds for _, contents in sent) == len(CASES) * len(AUDIENCES)
    expected = sum(len(contents) * len(AUDIENCES[int(name[-1])]) for name, contents in sent)
    return has_begun and sum(map(len, list(SEEN.values()))) >= expected


def judge():
    """Return who has seen what they must not."""
    for (name, who), seen in SEEN.items():
        contents = [content for content, _ in seen]
        if contents != SENT[name]:
            FOUND.append(f'{name}: {who} got {contents}, sent was {SENT[name]}')
    find_changed()
    for (_, who), seen in SEEN.items():
        for _, message in seen if who == 'keep' else ():
            change(message)
    find_changed(but='keep')
    FOUND.extend(f'changed: {content}' for value, content in HELD if repr(value) != content)
    return FOUND


def find_changed(*, but=''):
    for (name, who), seen in SEEN.items():
        kept = [(content, message) for content, message in seen if message and who != but]
        if any(repr(message) != content for content, message in kept):
            FOUND.append(f'{name}: what {who} has kept is changed')


# The cases.


@case(JointState)
def changes_it_at_once(node, go):
    message = send(node, begin(go.data))
    node.publish('out', message)
    change(message)


@case(JointState)
def changes_it_later(node, go):
    message = send(node, begin(go.data))
    later(message)
    return message


@case(JointState)
def changes_it_in_another_thread(node, go):
    message = send(node, begin(go.data))
    thread = threading.Thread(target=node.publish, args=('out', message))
    thread.start()
    thread.join()
    change(message)


@case(JointState)
async def changes_it_as_a_coroutine(node, go):
    message = send(node, begin(go.data))
    later(message.name, message.position)
    return message


@case(JointState)
def publishes_it_twice(node, go):
    message = send(node, begin(go.data))
    node.publish('out', message)
    return send(node, message)


@case(JointState)
def publishes_it_on_two_topics(node, go):
    message = send(node, begin(go.data))
    node.publish('out', message)
    node.publish('other', message)


@case(JointState)
def has_it_in_a_cache(node, go):
    return send(node, cached())


@cache
def cached():
    return hold(begin(1.0))


@case(JointState)
def has_it_in_arguments(node, go):
    send(node, ARGUMENTS[1])
    node.publish(*ARGUMENTS)
    send(node, ARGUMENTS[1])
    list(map(node.publish, ['out'], ARGUMENTS[1:]))


ARGUMENTS = ('out', hold(begin(5.0)))


@case(JointState)
def has_it_in_a_traceback(node, go):
    try:
        publish_and_fail(node, go.data)
    except KeyError as error:
        kept = error
        LATER.append(lambda: change(kept.__traceback__.tb_next.tb_frame.f_locals['message']))


def publish_and_fail(node, number):
    message = send(node, begin(number))
    node.publish('out', message)
    raise KeyError


@case(JointState)
def has_it_in_a_generator(node, go):
    generator = forever(go.data)
    send(node, next(generator))
    LATER.append(lambda: change(next(generator)))
    return next(generator)


def forever(number):
    message = begin(number)
    while True:
        yield message


@case(JointState)
def lets_it_go(node, go):
    return send(node, begin(go.data))


@case(PoseArray)
def has_one_pose_thrice(node, go):
    pose = Pose(position=Point(x=go.data))
    message = send(node, PoseArray(poses=[pose, pose, pose]))
    del pose
    return message


@case(PoseArray)
def copies_it_on_the_surface(node, go):
    message = PoseArray(poses=[Pose(position=Point(x=go.data))])
    later(message)
    return send(node, copy.copy(message))


@case(PoseArray)
def has_parts_of_many_messages(node, go):
    POSES.append(Pose(position=Point(x=go.data)))
    return send(node, PoseArray(poses=POSES[:]))


POSES = []


@case(DiagnosticArray)
def lets_lists_grow(node, go):
    # Nodes run at the same time: one must not change what another has noted and not yet published.
    diagnostics = DIAGNOSTICS[node.name]
    diagnostics.status.append(DiagnosticStatus())
    diagnostics.status[0].values.append(KeyValue(key='key'))
    return send(node, diagnostics)


DIAGNOSTICS = defaultdict(DiagnosticArray)


@case(PoseArray)
def publishes_a_mapping(node, go):
    payload = {'header': Header(frame_id='base'), 'poses': [{'position': Point(x=go.data)}]}
    send(node, PoseArray(header=payload['header'], poses=[Pose(position=Point(x=go.data))]))
    later(payload['header'], payload['poses'][0]['position'])
    return payload


@case(Image)
def publishes_bytes_of_its_own(node, go):
    data = bytearray([int(go.data)] * 9)
    array_of_it = np.frombuffer(data, np.uint8)
    send(node, Image(data=bytes(data)))
    later(array_of_it)
    return {'data': [data, memoryview(data), array_of_it][int(go.data) % 3]}


@case(Image)
def has_the_array(node, go):
    data = array('B', [1, 2, int(go.data)])
    later(data)
    return send(node, Image(data=data))


@case(Image)
def has_a_view_of_the_array(node, go):
    message = Image(data=bytes(12))
    later(np.frombuffer(message.data, np.uint8).reshape(3, 4)[1:])
    return send(node, message)


@case(Image)
def finds_the_array_by_a_weak_reference(node, go):
    message = Image(data=bytes(12))
    weak = weakref.ref(message.data)
    LATER.append(lambda: change(weak()))
    return send(node, message)


@case(Imu)
def has_a_view_of_numpy(node, go):
    message = Imu()
    later(message.orientation_covariance.reshape(3, 3)[1])
    return send(node, message)


@case(Imu)
def shows_memory_of_its_own(node, go):
    message = Imu()
    memory = (ctypes.c_double * 9)()
    # As a class derived from the message may do.
    message._orientation_covariance = np.ctypeslib.as_array(memory)
    LATER.append(lambda: memory.__setitem__(0, 7.0))
    return send(node, message)


@case(Imu)
def finds_numpy_by_a_weak_reference(node, go):
    message = Imu()
    weak = weakref.ref(message.orientation_covariance)
    LATER.append(lambda: change(weak()))
    return send(node, message)


@case(UnboundedSequences)
def has_one_list_in_two_fields(node, go):
    message = UnboundedSequences(string_values=['a'], basic_types_values=[BasicTypes()] * 2)
    message.string_values_default = message.string_values
    message.int8_values_default = message.int8_values = array('b', [1, 2])
    return send(node, message)


@case(MultiNested)
def has_what_is_nested_deep(node, go):
    message = MultiNested()
    message.unbounded_sequence_of_arrays = [Arrays()] * 2
    later(message.array_of_arrays[1].basic_types_values[0], message.array_of_arrays[2].byte_values)
    return send(node, message)
