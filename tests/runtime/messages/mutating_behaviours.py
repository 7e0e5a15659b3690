"""Behaviours that try to see each other's changes; `test_nobody_sees_changes.py` runs them.

Each case publishes a message when it hears one of the topic `go`, and keeps what it can of it. When
all messages have arrived, `judge` changes what was kept and looks for whom else it has changed.
"""

from array import array
from collections import defaultdict
from functools import cache, partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseArray
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header
from test_msgs.msg import BasicTypes, UnboundedSequences

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
def publishes_it_twice(node, go):
    message = send(node, begin(go.data))
    node.publish('out', message)
    return send(node, message)


@case(JointState)
def has_it_in_a_cache(node, go):
    return send(node, cached())


@cache
def cached():
    return hold(begin(1.0))


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


@case(PoseArray)
def has_one_pose_thrice(node, go):
    pose = Pose(position=Point(x=go.data))
    message = send(node, PoseArray(poses=[pose, pose, pose]))
    del pose
    return message


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


@case(UnboundedSequences)
def has_one_list_in_two_fields(node, go):
    message = UnboundedSequences(string_values=['a'], basic_types_values=[BasicTypes()] * 2)
    message.string_values_default = message.string_values
    message.int8_values_default = message.int8_values = array('b', [1, 2])
    return send(node, message)
