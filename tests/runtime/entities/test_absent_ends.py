"""Publishers and subscriptions that come when they are wanted, or that a library makes."""

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import String

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text
from tests.running import wait_for

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  lazy:
    publishers:
      out: {type: std_msgs/msg/String, on_matched: 'parts:look', external: true}
      made: {type: std_msgs/msg/String, made_by: library}
      later: {type: std_msgs/msg/String, active: false, external: true}
    subscriptions:
      image:
        {type: std_msgs/msg/String, behaviour: 'parts:hear', publish: out, active: false, external: true}
    on_start: parts:begin
  ear:
    subscriptions:
      made: {type: std_msgs/msg/String, behaviour: 'parts:tell'}
"""
CODE = """
from std_msgs.msg import String

def begin(node):
    node.state.made = node.ros.create_publisher(String, 'made', 10)
    node.publish('later', 'nobody hears this')
    for use in (lambda: node.publish('made', 'x'), lambda: activate(node, 'made')):
        try:
            use()
        except Exception as error:
            node.logger.info(f'refused: {error}')

def activate(node, name):
    node.publishers[name].active = True

def look(node, event):
    image = node.subscriptions['image']
    image.active = image.active = event.current_count > 0
    node.publishers['later'].active = image.active
    node.logger.info(f'{sorted(node.subscriptions)} {image.active}')

def hear(node, message):
    node.state.made.publish(message)
    node.publishers['later'].publish(message)
    return message

def tell(node, message):
    node.logger.info(f'heard {message.data}')
"""


def test_they_are_there_while_they_are_wanted(compose, peer):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    count = peer.node.count_subscribers
    assert len(child.matching('refused: ')) == 2
    images = peer.run(peer.node.create_publisher, String, '/image', 10)
    assert count('/image') == 0
    later = peer.listen(String, '/later')
    for turn in (1, 2):
        heard = peer.listen(String, '/out')
        wait_for(lambda: count('/image') == 1, 'the subscription')
        wait_for(lambda: peer.node.count_publishers('/later') == 1, 'the publisher')

        def arrives(heard=heard):
            images.publish(String(data='x'))
            return heard and len(later) >= turn  # noqa: B023 - called in this turn

        wait_for(arrives, 'messages that are passed on')
        child.wait_for_line('heard x')
        (end,) = [each for each in peer.node.subscriptions if each.topic_name == '/out']
        peer.run(peer.node.destroy_subscription, end)
        wait_for(lambda: count('/image') == 0, 'the end of the subscription')
    # An edit that gives it to the graph from the start.
    compose.write(SYSTEM.replace('publish: out, active: false', 'publish: out'), CODE)
    child.wait_for_line('reloaded in')
    wait_for(lambda: count('/image') == 1, 'the subscription of the edit')
    assert child.stop() == 0, child.output


@pytest.mark.parametrize(
    ('changed', 'expected'),
    [
        (
            ("behaviour: 'parts:hear', publish: out,", 'made_by: library,'),
            ["'made_by' and 'active' cannot be used together in subscription 'image'"],
        ),
        (
            ("behaviour: 'parts:hear', publish: out,", ''),
            ["'behaviour' or 'publish' is missing in subscription 'image'"],
        ),
    ],
)
def test_what_is_wrong_with_them_is_a_finding(changed, expected):
    system = load_system_text(SYSTEM.replace(*changed))
    assert [each.message for each in system.diagnostics] == expected


def test_what_a_library_publishes_is_known():
    findings = check_system(load_system_text(SYSTEM), InterfaceCatalogue())
    assert not [each for each in findings if 'made' in each.message]
