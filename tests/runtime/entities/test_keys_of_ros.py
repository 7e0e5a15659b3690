"""What ROS has for entities and nodes, as keys of the file: QoS overrides, introspection and more."""

import importlib.util

import pytest

pytest.importorskip('rclpy')

from std_srvs.srv import Trigger

from tests.running import wait_for

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes:
  talker:
    parameter_files: [values.yaml]
    publishers: {chatter: {type: std_msgs/msg/String, qos_overrides: [depth, durability]}}
    timers: {say: {period: 0.05, publish: chatter, message: {data: hi}}}
  hearer:
    subscriptions:
      raw: {topic: chatter, type: std_msgs/msg/String, raw: true, behaviour: 'parts:hear_raw'}
      plain: {topic: chatter, type: std_msgs/msg/String, behaviour: 'parts:hear'}
  holder:
    allow_undeclared_parameters: true
    automatically_declare_parameters_from_overrides: true
    parameter_files: [values.yaml]
    parameters: {speed: {default: 1.0, maximum: 10.0}}
    before_parameters_set: parts:limit
    on_parameters: parts:decide
    after_parameters_set: parts:follow
    on_start: parts:begin
    services: {ask: {type: std_srvs/srv/Trigger, introspection: metadata, behaviour: 'parts:answer'}}
  setter:
    timers: {set: {period: 0.05, behaviour: 'parts:set_once'}}
    service_clients: {ask: std_srvs/srv/Trigger}
"""
VALUES = """\
talker:
  ros__parameters:
    qos_overrides: {/chatter: {publisher: {depth: 77, durability: transient_local}}}
holder:
  ros__parameters: {speed: 2.0, gains: {p: 1.5, i: 0.5}}
"""
CODE = """\
from rclpy.serialization import deserialize_message
from std_msgs.msg import String


def hear_raw(node, message):
    node.logger.info(f'raw {type(message).__name__} {deserialize_message(message, String).data}')


def hear(node, message):
    node.logger.info(f'plain {message.data}')


def limit(node, changes):
    node.logger.info(f'before {changes}')
    if 'never' in changes:
        return {}
    return {name: min(value, 5) if name == 'speed' else value for name, value in changes.items()}


def decide(node, changes):
    node.logger.info(f'on {changes}')


def follow(node, changes):
    node.logger.info(f'after {changes} {node.parameters.speed}')


def begin(node):
    node.logger.info(f'begun with {node.parameters.speed} {node.parameters("gains")}')


def set_once(node):
    if node.own_state:
        return
    node.own_state['is_set'] = True
    node.set_parameters('/holder', {'speed': 50.0})
    node.set_parameters('/holder', {'new': 'x'})
    try:
        node.set_parameters('/holder', {'never': 1})
    except Exception as error:
        node.logger.info(f'refused: {type(error).__name__}')
    node.logger.info(node.call('ask').message)


def answer(node, request):
    return {'success': True, 'message': 'hello'}
"""


def test_the_keys_do_what_ros_does(compose, peer):
    (compose.folder / 'values.yaml').write_text(VALUES)
    events = []
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    assert not child.matching('warning['), child.output
    for line in (
        "[holder]: begun with 2.0 {'p': 1.5, 'i': 0.5}",
        '[hearer]: raw bytes hi',
        '[hearer]: plain hi',
        "[holder]: before {'speed': 50.0}",
        "[holder]: on {'speed': 5.0}",
        "[holder]: after {'speed': 5.0} 5.0",
        "[holder]: after {'new': 'x'} 5.0",
        '[setter]: refused: ParametersRefusedError',
        '[setter]: hello',
    ):
        child.wait_for_line(line)
    assert not child.matching("on {'never'")

    def durability():
        found = peer.node.get_publishers_info_by_topic('/chatter')
        return found and found[0].qos_profile.durability.name

    wait_for(lambda: durability() == 'TRANSIENT_LOCAL', 'the QoS that the parameter gives')
    from std_srvs.srv import Trigger_Event

    peer.run(
        peer.node.create_subscription, Trigger_Event, '/ask/_service_event', events.append, 10
    )

    def asked(count):
        peer.call(Trigger, '/ask')
        return len(events) > count

    wait_for(lambda: asked(1), 'events of the service')
    assert not events[-1].response
    # Both are edited as any other key.
    (compose.folder / 'values.yaml').write_text(VALUES.replace('transient_local', 'volatile'))
    compose.write(SYSTEM.replace('introspection: metadata', 'introspection: contents'), CODE)
    wait_for(lambda: durability() == 'VOLATILE', 'the other QoS')
    wait_for(lambda: asked(1) and events[-1].response, 'contents in the events')
    compose.write(SYSTEM.replace('raw: true', "content_filter: {expression: data = 'hi'}"), CODE)
    if importlib.util.find_spec('rclpy.subscription_content_filter_options') is None:
        child.wait_for_line('error[no-content-filter]: this rclpy has no content filters')
    assert child.stop() == 0
