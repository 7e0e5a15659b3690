"""Parameters through the parameter services, as any ROS 2 tool uses them."""

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterEvent, ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  plain: &plain
    parameters:
      text: Alice
      number: 3
      ratio: 0.5
      flag: false
      texts: [a, b]
      numbers: [1, 2]
      ratios: [1, 2.5]
      flags: [true, false]
      octets: {default: [0, 255], type: byte_array}
      nothing: {default: [], type: string_array}
      fixed: {default: [], type: double_array, read_only: true}
      unset: {type: integer, description: To be given later.}
      group.inner.deep: 1
      whole: {default: 2, type: double}
      speed: {default: 1.0, minimum: 0.0, maximum: 2, step: 0.5, description: Metres per second.}
      count: {default: 4, minimum: 0, maximum: 10, step: 2}
      positive: {default: 1, minimum: 0}
      mode: {default: slow, choices: [slow, fast]}
      gear: {default: 1, choices: [1, 2, 4]}
      serial: {default: A1, read_only: true}
  untouched: *plain
  judging:
    parameters: {limit: 1, other: a, mode: {default: slow, choices: [slow, fast]}}
    on_parameters: parts:judge
  judging_later:
    parameters: {limit: 1}
    on_parameters: {behaviour: 'parts:judge_later', with: {bound: 10}}
  stumbling:
    parameters: {limit: 1}
    on_parameters: parts:stumble
  lonely:
    parameters: {name: Alice, keys: taken, unset: {type: integer}}
    on_start: parts:look
"""

CODE = """
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future

def judge(node, changes):
    node.logger.info(f'asked {dict(changes)}, limit is {node.parameters.limit}')
    if changes.get('limit', 0) > 5:
        return f'{changes["limit"]} is too much'

async def judge_later(node, changes, bound):
    answer = Future()
    group = ReentrantCallbackGroup()
    timer = node.ros.create_timer(0.01, lambda: answer.set_result(bound), callback_group=group)
    limit = await answer
    node.ros.destroy_timer(timer)
    return 'too much' if changes['limit'] > limit else None

def stumble(node, changes):
    raise RuntimeError('no idea')

def look(node):
    parameters = node.parameters
    log = node.logger.info
    log(f"in: {'name' in parameters}, {'nam' in parameters}")
    log(f"get: {parameters.get('name')}, {parameters.get('nam', 'nobody')}")
    log(f"getattr: {getattr(parameters, 'nam', 'nobody')}")
    log(f"keys: {parameters['keys']}, unset: {parameters.unset}")
    log(f"size: {len(parameters) == len(list(parameters)) == len(dict(parameters))}")
    try:
        parameters.nam  # composer: ignore[unknown-parameter]
    except Exception as error:
        log(f'{type(error).__name__}: {error}; {error.help}')
"""
# As the file gives them; the last two are what rclpy gives to every node.
VALUES = {
    'text': 'Alice',
    'number': 3,
    'ratio': 0.5,
    'flag': False,
    'texts': ['a', 'b'],
    'numbers': [1, 2],
    'ratios': [1.0, 2.5],
    'flags': [True, False],
    'octets': [b'\x00', b'\xff'],
    'nothing': [],
    'fixed': [],
    'group.inner.deep': 1,
    'whole': 2.0,
    'speed': 1.0,
    'count': 4,
    'positive': 1,
    'mode': 'slow',
    'gear': 1,
    'serial': 'A1',
    'use_sim_time': False,
    'start_type_description_service': False,
}


@pytest.fixture(scope='module')
def child(shared_compose):
    child = shared_compose(SYSTEM, CODE)
    child.wait_until_ready()
    return child


@pytest.fixture
def get(child, shared_peer):
    def get(name, node='plain'):
        response = shared_peer.call(GetParameters, f'/{node}/get_parameters', names=[name])
        return parameter_value_to_python(response.values[0])

    return get


@pytest.fixture
def change(child, shared_peer):
    """Set a parameter as a plain client does; return whether it was accepted, and the reason."""

    def change(name, value, node='plain'):
        message = Parameter(name, value=value).to_parameter_msg()
        response = shared_peer.call(SetParameters, f'/{node}/set_parameters', parameters=[message])
        return response.results[0].successful, response.results[0].reason

    return change


@pytest.fixture
def describe(child, shared_peer):
    def describe(name):
        response = shared_peer.call(DescribeParameters, '/plain/describe_parameters', names=[name])
        return response.descriptors[0]

    return describe


def test_a_new_node_has_the_values_of_the_file_in_their_types(child, shared_peer):
    listed = shared_peer.call(ListParameters, '/untouched/list_parameters').result.names
    assert sorted(listed) == sorted([*VALUES, 'unset'])
    response = shared_peer.call(GetParameters, '/untouched/get_parameters', names=[*VALUES])
    got = map(parameter_value_to_python, response.values)
    for (name, value), found in zip(VALUES.items(), got, strict=True):
        assert type(found) is type(value) or isinstance(value, list), name
        assert list(found) == value if isinstance(value, list) else found == value, name


def test_descriptors_tell_type_range_description_choices_and_read_only(describe):
    for name, kind in (
        ('octets', ParameterType.PARAMETER_BYTE_ARRAY),
        ('nothing', ParameterType.PARAMETER_STRING_ARRAY),
        ('unset', ParameterType.PARAMETER_INTEGER),
    ):
        assert (describe(name).type, describe(name).dynamic_typing) == (kind, False)
    speed, count, positive = describe('speed'), describe('count'), describe('positive')
    assert speed.description == 'Metres per second.'
    assert list(speed.floating_point_range) == [
        FloatingPointRange(from_value=0.0, to_value=2.0, step=0.5)
    ]
    assert list(count.integer_range) == [IntegerRange(from_value=0, to_value=10, step=2)]
    assert list(positive.integer_range) == [IntegerRange(from_value=0, to_value=2**63 - 1, step=0)]
    assert describe('unset').description == 'To be given later.'
    assert describe('mode').additional_constraints == 'one of slow, fast'
    assert describe('gear').additional_constraints == 'one of 1, 2, 4'
    assert describe('serial').read_only
    assert not describe('text').read_only


FITTING = [
    ('text', ''),
    ('number', -(2**63)),
    ('ratio', 1e308),
    ('flag', True),
    ('texts', ['c']),
    ('unset', 4),
    ('speed', 1.5),
    ('gear', 4),
    # As in files, an integer is a double, and an empty list has the type that is declared.
    ('ratio', 3),
    ('ratios', [3, 4]),
    ('texts', []),
    ('octets', []),
]


def test_a_value_that_fits_is_set(change, get, describe):
    for name, value in FITTING:
        kind = describe(name).type
        assert change(name, value) == (True, ''), name
        assert get(name) == value
        assert describe(name).type == kind


REFUSED = [
    ('speed', 2.5, 'Parameter speed out of range Min: 0.0, Max: 2.0, value: 2.5'),
    (
        'speed',
        0.7,
        'The parameter value for speed is not close enough to a valid step. '
        'Min: 0.0, max: 2.0, value: 0.7, step: 0.5',
    ),
    ('count', -1, 'Parameter count out of range. Min: 0, Max: 10, value: -1'),
    ('mode', 'quick', "'quick' is not one of slow, fast"),
    ('serial', 'B2', 'Trying to set a read-only parameter: serial.'),
    (
        'number',
        'three',
        # rclpy 9 writes the types' numbers.
        f"Wrong parameter type, expected '{Parameter.Type.INTEGER}' got '{Parameter.Type.STRING}'",
    ),
]


def test_a_refused_value_says_why_and_changes_nothing(change, get):
    for name, value, reason in REFUSED:
        before = get(name)
        assert change(name, value) == (False, reason)
        assert get(name) == before


def test_an_undeclared_parameter_is_refused(change):
    accepted, reason = change('txet', 'Bob')

    assert not accepted
    assert reason.startswith('Invalid access to undeclared parameter(s)')


def test_a_change_is_told_to_those_who_listen_for_parameter_events(
    child, shared_peer, change, wait_for
):
    events = shared_peer.listen(ParameterEvent, '/parameter_events', 100)
    wait_for(
        lambda: len(shared_peer.node.get_publishers_info_by_topic('/parameter_events')) > 4,
        'the publishers of events',
    )
    # Discovery of the topic does not yet mean that both ends have met.
    wait_for(lambda: change('number', 9)[0] and events, 'an event')

    assert events[-1].node == '/plain'
    assert events[-1].changed_parameters[0].value.integer_value == 9


def test_on_parameters_hears_a_change_before_it_is_made_and_gives_a_reason(
    child, shared_peer, change, get
):
    assert change('limit', 4, 'judging') == (True, '')
    child.wait_for_line("[INFO] [judging]: asked {'limit': 4}, limit is 1")
    assert get('limit', 'judging') == 4
    # An atomic change is one.
    messages = [
        Parameter('limit', value=7).to_parameter_msg(),
        Parameter('other', value='b').to_parameter_msg(),
    ]
    result = shared_peer.call(
        SetParametersAtomically, '/judging/set_parameters_atomically', parameters=messages
    ).result
    assert (result.successful, result.reason) == (False, '7 is too much')
    child.wait_for_line("asked {'limit': 7, 'other': 'b'}")
    assert (get('limit', 'judging'), get('other', 'judging')) == (4, 'a')


def test_on_parameters_may_be_async(change, get):
    assert change('limit', 11, 'judging_later') == (False, 'too much')
    assert get('limit', 'judging_later') == 1
    assert change('limit', 9, 'judging_later') == (True, '')
    assert get('limit', 'judging_later') == 9


def test_on_parameters_that_raises_refuses_and_is_logged(child, change, get):
    assert change('limit', 2, 'stumbling') == (
        False,
        'on_parameters raised an error',
    )
    assert get('limit', 'stumbling') == 1
    line = SYSTEM.splitlines().index('    on_parameters: parts:stumble') + 1
    child.wait_for_line(
        f'[ERROR] [stumbling]: on_parameters (system.yaml:{line}) raised RuntimeError: no idea'
    )


def test_a_wrong_override_ends_the_start_with_a_clear_line(compose):
    text = 'version: 1\nnodes: {first: {parameters: {rate: 1.0}}}\n'
    child = compose(text, '', '--ros-args', '-p', 'first:rate:=2')

    assert child.wait() == 1
    assert child.lines == [
        "error: node 'first': parameter 'rate' from the command line: Trying to set parameter "
        "'rate' to '2' of type 'INTEGER', expecting type 'DOUBLE'",
        '  help: write 2.0',
    ]


def test_parameters_are_a_mapping_with_what_a_mapping_offers(child):
    assert child.matching('[lonely]') == [
        '[INFO] [lonely]: in: True, False',
        '[INFO] [lonely]: get: Alice, nobody',
        '[INFO] [lonely]: getattr: nobody',
        '[INFO] [lonely]: keys: taken, unset: None',
        '[INFO] [lonely]: size: True',
        "[INFO] [lonely]: UndeclaredParameterError: node 'lonely' has no parameter 'nam'; "
        "did you mean 'name'?",
    ]
