"""What a file declares is what a peer in another process sees: names, types and QoS."""

import pytest

pytest.importorskip('rclpy')

from rclpy.duration import Duration, Infinite
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from std_msgs.msg import Int32, String

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
defaults: {namespace: fleet}
qos:
  latched: {depth: 3, durability: transient_local}
  careful:
    profile: latched
    deadline: 0.5
    lifespan: 2.5
    liveliness: manual_by_topic
    liveliness_lease_duration: 1.5
nodes:
  talker:
    publishers:
      relative: std_msgs/msg/Int32
      absolute: {type: std_msgs/msg/String, topic: /absolute}
      private: {type: std_msgs/msg/Float64, topic: ~/private}
      substituted: {type: std_msgs/msg/String, topic: '{ns}/of/{node}'}
  scoped:
    namespace: inner/most
    publishers: {relative: std_msgs/msg/Int32}
    subscriptions:
      private: {type: std_msgs/msg/String, topic: ~/private, behaviour: 'parts:ignore'}
  rooted:
    namespace: /
    publishers: {relative: std_msgs/msg/Int32}
  remapped:
    namespace: /other
    remap:
      plain: moved/there
      /absolute: /elsewhere
      ~/mine: ~/yours
      rostopic://scheme: by_scheme
      rosservice://service: not_a_topic
      first: winner
      /other/first: loser
    publishers:
      plain: std_msgs/msg/String
      absolute: {type: std_msgs/msg/String, topic: /absolute}
      mine: {type: std_msgs/msg/String, topic: ~/mine}
      scheme: std_msgs/msg/String
      service: std_msgs/msg/String
      first: std_msgs/msg/String
      plainer: std_msgs/msg/String
  qualities:
    namespace: /qos
    publishers:
      by_depth: {type: std_msgs/msg/Int32, qos: 7}
      by_name: {type: std_msgs/msg/Int32, qos: latched}
      by_policies: {type: std_msgs/msg/Int32, qos: {profile: careful, lifespan: 3.5}}
      by_nothing: std_msgs/msg/Int32
    on_start: parts:count
"""

CODE = """
def ignore(node, message):
    pass

def count(node):
    for number in range(10):
        node.publish('by_name', number)
"""


@pytest.fixture
def publisher_of(graph, wait_for):
    def find(topic):
        return wait_for(lambda: graph.get_publishers_info_by_topic(topic), topic)[0]

    return find


def test_nodes_are_in_their_namespaces(graph, wait_for):
    expected = {
        ('talker', '/fleet'),
        ('scoped', '/fleet/inner/most'),
        ('rooted', '/'),
        ('remapped', '/other'),
        ('qualities', '/qos'),
        ('peer', '/'),
        # It publishes /diagnostics, and `ros2 node list` hides it.
        ('_composer_system', '/'),
    }

    wait_for(lambda: set(graph.get_node_names_and_namespaces()) >= expected, 'all nodes')
    assert sorted(graph.get_node_names_and_namespaces()) == sorted(expected)


@pytest.mark.parametrize(
    ('node', 'namespace', 'topics'),
    [
        (
            'talker',
            '/fleet',
            {
                '/fleet/relative': 'std_msgs/msg/Int32',
                '/absolute': 'std_msgs/msg/String',
                '/fleet/talker/private': 'std_msgs/msg/Float64',
                '/fleet/of/talker': 'std_msgs/msg/String',
            },
        ),
        ('scoped', '/fleet/inner/most', {'/fleet/inner/most/relative': 'std_msgs/msg/Int32'}),
        ('rooted', '/', {'/relative': 'std_msgs/msg/Int32'}),
        (
            'remapped',
            '/other',
            {
                '/other/moved/there': 'std_msgs/msg/String',
                '/elsewhere': 'std_msgs/msg/String',
                '/other/remapped/yours': 'std_msgs/msg/String',
                '/other/by_scheme': 'std_msgs/msg/String',
                '/other/service': 'std_msgs/msg/String',
                '/other/winner': 'std_msgs/msg/String',
                '/other/plainer': 'std_msgs/msg/String',
            },
        ),
    ],
)
def test_publishers_have_exactly_the_topics_of_the_file(graph, wait_for, node, namespace, topics):
    expected = {topic: [kind] for topic, kind in topics.items()}
    # Every node has these, the second one with its parameter services soon after the start.
    expected |= {
        '/rosout': ['rcl_interfaces/msg/Log'],
        '/parameter_events': ['rcl_interfaces/msg/ParameterEvent'],
    }

    def seen():
        return dict(graph.get_publisher_names_and_types_by_node(node, namespace))

    wait_for(lambda: (node, namespace) in graph.get_node_names_and_namespaces(), node)
    wait_for(lambda: seen().keys() >= expected.keys(), 'all topics')
    assert seen() == expected


def test_subscriptions_have_exactly_the_topics_of_the_file(graph, wait_for):
    def seen():
        return dict(graph.get_subscriber_names_and_types_by_node('scoped', '/fleet/inner/most'))

    wait_for(
        lambda: ('scoped', '/fleet/inner/most') in graph.get_node_names_and_namespaces(), 'node'
    )
    assert wait_for(seen, 'topics') == {
        '/fleet/inner/most/scoped/private': ['std_msgs/msg/String']
    }


@pytest.mark.parametrize('topic', ['/qos/by_depth', '/qos/by_nothing'])
def test_qos_by_depth_is_otherwise_the_default_of_ros(publisher_of, topic):
    profile = publisher_of(topic).qos_profile

    assert profile.reliability is ReliabilityPolicy.RELIABLE
    assert profile.durability is DurabilityPolicy.VOLATILE
    assert profile.deadline == Infinite


def test_qos_by_policies_starts_from_its_profile_and_differs_where_it_says(publisher_of):
    profile = publisher_of('/qos/by_policies').qos_profile

    assert profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert profile.reliability is ReliabilityPolicy.RELIABLE
    assert profile.deadline == Duration(seconds=0.5)
    assert profile.lifespan == Duration(seconds=3.5)
    assert profile.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
    assert profile.liveliness_lease_duration == Duration(seconds=1.5)


def test_depth_is_how_many_messages_a_latched_publisher_keeps(graph, shared_peer, wait_for):
    late = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    heard = shared_peer.listen(Int32, '/qos/by_name', late)

    wait_for(lambda: heard and heard[-1].data == 9, 'the last message')
    assert [message.data for message in heard] == [7, 8, 9]


def test_rules_of_the_command_line_win_over_those_of_the_file(compose, peer, wait_for):
    text = """
        version: 1
        nodes:
          talker:
            remap: {chatter: from_file, other: from_file_too}
            publishers: {chatter: std_msgs/msg/String, other: std_msgs/msg/String}
            timers:
              tick: {period: 0.05, publish: chatter, message: {data: hello}}
          second:
            publishers: {chatter: std_msgs/msg/String}
    """
    heard = peer.listen(String, 'from_command_line')
    compose(text, '', '--ros-args', '-r', 'talker:chatter:=from_command_line')

    assert wait_for(lambda: heard, 'a message')[0].data == 'hello'

    def topics():
        return dict(peer.node.get_topic_names_and_types()).keys()

    wait_for(lambda: topics() >= {'/from_file_too', '/chatter'}, 'the other topics')
    assert '/from_file' not in topics()


def test_a_name_for_all_nodes_on_the_command_line_is_refused(compose):
    text = 'version: 1\nnodes: {a: {}, b: {}}\n'
    child = compose(text, '', '--ros-args', '-r', '__node:=c')

    assert child.wait() == 2
    assert child.lines == [
        "error: '__node:=c' would give all nodes of the system one name",
        '  help: name the node that is meant, as in talker:__node:=c',
    ]
