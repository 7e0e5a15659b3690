"""What a node has of ROS's own: only what the file or the convention asks for."""

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import Log, ParameterEvent, ParameterType
from rcl_interfaces.srv import GetLoggerLevels, GetParameters, ListParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from type_description_interfaces.srv import GetTypeDescription

pytestmark = pytest.mark.ros

PARAMETER_SERVICES = {
    'describe_parameters',
    'get_parameter_types',
    'get_parameters',
    'list_parameters',
    'set_parameters',
    'set_parameters_atomically',
}
LOGGER_SERVICES = {'get_logger_levels', 'set_logger_levels'}
TYPE_DESCRIPTION_SERVICE = {'get_type_description'}

SYSTEM = """
version: 1
nodes:
  plain: {subscriptions: {word: {type: std_msgs/msg/String, behaviour: 'parts:ignore'}}}
  with_parameters: {parameters: {speed: 1.5}}
  with_a_hook: {on_parameters: parts:ignore}
  lean: {parameter_services: false}
  spared: {parameters: {speed: 1.5}, parameter_services: false}
  all_of_them:
    parameter_services: true
    type_description_service: true
    logger_services: true
  described:
    namespace: deep
    type_description_service: true
    publishers: {word: std_msgs/msg/String}
  levelled: {logger_services: true}
  silent: {rosout: false}
  last: {}
"""

CODE = """
import threading
from rclpy.parameter import Parameter

def ignore(node, message):
    pass

def tell(node):
    node.logger.info(f'I am {node.name}')

def change(node):
    if not node.ros.has_parameter('mode'):
        node.ros.declare_parameter('mode', 0)
    node.ros.set_parameters([Parameter('mode', value=node.parameters.mode + 1)])

def tell_simulated(node):
    value = node.ros.get_parameter('use_sim_time').value
    node.logger.info(f'{node.name} simulates: {value}')

def set_of_lean(node):
    try:
        node.set_parameters('lean', {'speed': 2.0}, timeout=30)  # composer: ignore[unknown-parameter]
    except Exception as error:
        node.logger.info(f'{type(error).__name__}: {error}; {error.help}')

def ask_plain(node):
    values = node.get_parameters('plain', ['use_sim_time'], timeout=30)
    node.logger.info(f"plain simulates: {values['use_sim_time']}")

def block(node):
    node.logger.info(f'{node.name} blocks')
    threading.Event().wait()

def live(node):
    node.state.ticks += 1
    node.logger.info(f'life {node.state.life}, tick {node.state.ticks}')
    if node.state.life == 1 and node.state.ticks == 3:
        raise RuntimeError('out of order')

def begin(node):
    lives.append(node.name)
    node.state.life = len(lives)

lives = []
"""

LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def services_of(graph, wait_for):
    """Return a function that returns the last parts of the names of a node's services."""

    def seen(node, namespace='/'):
        if (node, namespace) not in graph.get_node_names_and_namespaces():
            return set()
        found = graph.get_service_names_and_types_by_node(node, namespace)
        start = f'{namespace.rstrip("/")}/{node}/'
        return {name.removeprefix(start) for name, _ in found}

    # What was created before has been announced before.
    wait_for(lambda: seen('last') >= PARAMETER_SERVICES, 'the services of the last node')
    return seen


SERVICES = {
    ('plain', '/'): PARAMETER_SERVICES,
    ('with_parameters', '/'): PARAMETER_SERVICES,
    ('with_a_hook', '/'): PARAMETER_SERVICES,
    ('lean', '/'): set(),
    ('spared', '/'): set(),
    ('silent', '/'): PARAMETER_SERVICES,
    ('described', '/deep'): PARAMETER_SERVICES | TYPE_DESCRIPTION_SERVICE,
    ('levelled', '/'): PARAMETER_SERVICES | LOGGER_SERVICES,
    ('all_of_them', '/'): PARAMETER_SERVICES | TYPE_DESCRIPTION_SERVICE | LOGGER_SERVICES,
}
TOPICS = {
    'plain': {'/rosout', '/parameter_events'},
    'spared': {'/rosout', '/parameter_events'},
    'lean': {'/rosout'},
    'silent': {'/parameter_events'},
}


def test_a_node_has_the_services_and_topics_that_the_file_asks_for_and_no_others(
    graph, services_of, wait_for
):
    for key, expected in SERVICES.items():
        wait_for(lambda: services_of(*key) >= expected, f'the services of {key}')  # noqa: B023
        assert services_of(*key) == expected, key

    def topics_of(node):
        return {name for name, _ in graph.get_publisher_names_and_types_by_node(node, '/')}

    for node, topics in TOPICS.items():
        wait_for(lambda: topics_of(node) >= topics, f'the topics of {node}')  # noqa: B023
        assert topics_of(node) == topics, node


def test_services_that_were_asked_for_answer(graph, shared_peer, wait_for):
    assert graph.get_name() == 'peer'
    response = shared_peer.call(ListParameters, '/plain/list_parameters')
    assert 'use_sim_time' in response.result.names
    request = {'names': ['levelled']}
    (level,) = shared_peer.call(GetLoggerLevels, '/levelled/get_logger_levels', **request).levels
    assert level.name == 'levelled'
    name = 'std_msgs/msg/String'
    wait_for(lambda: graph.get_publishers_info_by_topic('/deep/word'), 'the publisher')
    (publisher,) = graph.get_publishers_info_by_topic('/deep/word')
    wanted = {'type_name': name, 'type_hash': str(publisher.topic_type_hash)}
    service = '/deep/described/get_type_description'
    described = shared_peer.call(GetTypeDescription, service, **wanted)
    assert described.type_description.type_description.type_name == name


def test_a_peer_hears_what_behaviours_log_and_change_unless_the_file_turns_it_off(
    compose, peer, wait_for
):
    text = """
        version: 1
        defaults: {namespace: deep, rosout: false}
        nodes:
          silent: {timers: {tell: {period: 0.05, behaviour: 'parts:tell'}}}
          changing:
            parameter_services: false
            timers: {change: {period: 0.05, behaviour: 'parts:change'}}
          heard: {rosout: true, timers: {tell: {period: 0.05, behaviour: 'parts:tell'}}}
    """
    logs = peer.listen(Log, '/rosout', 10)
    events = peer.listen(ParameterEvent, '/parameter_events')
    child = compose(text, CODE)
    line = wait_for(lambda: [log for log in logs if log.name == 'deep.heard'], 'a line')[0]
    child.wait_for_line('[deep.silent]: I am silent')

    assert (line.msg, line.level, line.function) == ('I am heard', Log.INFO, 'tell')
    assert line.file.endswith('parts.py')
    assert {log.name for log in logs} == {'deep.heard'}
    event = wait_for(lambda: [each for each in events if each.changed_parameters], 'a change')[0]
    assert event.node == '/deep/changing'
    assert [parameter.name for parameter in event.changed_parameters] == ['mode']


def test_the_command_line_has_the_last_word_on_what_the_file_sets(compose, peer):
    text = """
        version: 1
        nodes:
          one: {use_sim_time: true, on_start: parts:tell_simulated}
          two: {use_sim_time: true, on_start: parts:tell_simulated}
          three: {on_start: parts:tell_simulated, parameter_services: true}
    """
    child = compose(
        text,
        CODE,
        '--ros-args',
        '-p',
        'one:use_sim_time:=false',
        '-p',
        'three:start_type_description_service:=true',
    )
    child.wait_until_ready()

    assert child.matching('simulates: ') == [
        '[INFO] [one]: one simulates: False',
        '[INFO] [two]: two simulates: True',
        '[INFO] [three]: three simulates: False',
    ]
    request = {'names': ['start_type_description_service']}
    (value,) = peer.call(GetParameters, '/three/get_parameters', **request).values
    assert (value.type, value.bool_value) == (ParameterType.PARAMETER_BOOL, True)
    peer.call(GetTypeDescription, '/three/get_type_description', type_name='x/msg/Y')


def test_a_start_that_waits_for_the_parameter_services_of_another_node_gets_them(compose):
    """They are created when the system is ready, which it is after this start."""
    text = """
        version: 1
        nodes:
          asking: {on_start: parts:ask_plain}
          setting: {timers: {ask: {period: 0.02, behaviour: 'parts:set_of_lean'}}}
          lean: {parameter_services: false}
          waiting: {wait_for: {service: plain/set_parameters}}
          plain: {}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    assert child.matching('plain simulates: False')
    assert child.wait_for_line('Error').endswith(
        "ServiceNotAvailableError: node '/lean' has no parameter services; "
        "write 'parameter_services: true' where the file declares it"
    )
    assert child.stop() == 0


def test_parameters_and_rosout_are_served_beside_what_blocks_and_after_a_restart(
    compose, peer, wait_for
):
    text = """
        version: 1
        executor: {shutdown_timeout: 0.2}
        nodes:
          blocking: {timers: {block: {period: 0.02, behaviour: 'parts:block'}}}
          phoenix:
            on_error: restart
            parameters: {mode: calm}
            state: {ticks: 0}
            publishers: {word: std_msgs/msg/String}
            subscriptions: {word: {type: std_msgs/msg/String, behaviour: 'parts:ignore'}}
            timers: {live: {period: 0.02, behaviour: 'parts:live'}}
            on_start: parts:begin
    """
    logs = peer.listen(Log, '/rosout', LATCHED)
    child = compose(text, CODE)
    child.wait_for_line('blocking blocks')
    child.wait_for_line("node 'phoenix' was restarted")
    for node in ('blocking', 'phoenix'):
        response = peer.call(ListParameters, f'/{node}/list_parameters')
        assert 'use_sim_time' in response.result.names
    wait_for(lambda: [log for log in logs if log.msg.startswith('life 2')], 'the second life')
    assert not child.matching('already registered')
    assert not child.matching('still holds')
