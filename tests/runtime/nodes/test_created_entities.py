"""Entities that behaviours create: made, guarded and removed as those that a file declares."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes:
  rig:
    parameters: {source: cam_0}
    state: {timers: {}}
    timers: {idle: {period: 100, behaviour: 'parts:idle'}}
    on_start: parts:Rig.begin
  other:
    subscriptions:
      fixed: {type: std_msgs/msg/String, behaviour: 'parts:hear'}
"""
CODE = """\
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String


class Rig:
    def __init__(self, node):
        self.cameras = [node.create_publisher(String, f'cam_{i}', 10) for i in range(2)]
        node.create_subscription(String, node.parameters.source, self.hear)
        node.create_subscription('std_msgs/msg/String', 'cam_1', hear, qos_profile_sensor_data)
        self.fast = node.create_timer(0.05, self.tick)
        for make in (steps, steps_later):
            node.state.timers[make.__name__] = node.create_timer(0.05, make)
        qos = {'durability': 'transient_local'}
        node.create_publisher(String, 'fixed', qos, on_matched=self.matched)
        refused(node, String, 'x', on_matched='parts:hear')
        node.create_service('std_srvs/srv/Trigger', 'ask', self.answer)
        self.client = node.create_client('std_srvs/srv/Trigger', 'ask')
        self.number = 0

    def begin(self, node):
        node.create_timer(0.05, self.ask, group='reentrant')
        for wrong in (('std_msgs/msg/Strin', 'x'), (String, 'a b'), (String, 'x', -1)):  # composer: ignore[unknown-type]
            refused(node, *wrong)
        refused(node, String, 'x', name='fixed')
        refused(node, String, 'x', colour=3)
        for out in ('fixt', 'fixed'):
            try:
                node.create_timer(0.05, give, publish=out)  # composer: ignore[unknown-publisher]
            except Exception as error:
                node.logger.info(f'wrong: {error}, {error.help}')

    def matched(self, node, event):
        node.logger.info(f'matched {event.current_count}')

    def answer(self, node, request):
        return {'success': True, 'message': f'yes {self.number > 2}'}

    def ask(self, node):
        node.logger.info(f'answered {self.client.call().message}')

    def tick(self, node):
        self.number += 1
        for each in self.cameras:
            each.publish(f'tick {self.number}')
        node.publish('fixed', 'x')
        if self.number == 20:
            node.destroy(self.fast)
            node.destroy(self.fast)
            node.logger.info('destroyed')

    def hear(self, node, message):
        if message.data == 'tick 2':
            raise ValueError('two')
        node.logger.info(f'rig heard {message.data}')


def refused(node, *arguments, **options):
    try:
        node.create_publisher(*arguments, **options)
    except Exception as error:
        node.logger.info(f'refused: {error}')


def steps(node):
    try:
        yield
        node.destroy(node.state.timers['steps'])
        yield
        node.logger.error('resumed')
    finally:
        node.logger.info('closed')


async def steps_later(node):
    try:
        yield
        node.destroy(node.state.timers['steps_later'])
        yield
        node.logger.error('resumed')
    finally:
        node.logger.info('closed')


def idle(node):
    pass


def give(node):
    return 'given'


def hear(node, message):
    node.logger.info(f'plain heard {message.data}')
"""


def test_what_a_behaviour_creates_works_as_what_the_file_declares(compose):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    assert len(child.matching('refused: ')) == 6, child.output
    assert child.matching("refused: node 'rig' has a publisher 'fixed' already")
    wrong = "a timer cannot publish: node 'rig' has no publisher 'fixt', did you mean 'fixed'?"
    assert [line.rpartition('wrong: ')[2] for line in child.matching('wrong: ')] == [wrong]
    for line in (
        '[other]: plain heard given',
        '[rig]: rig heard tick 1',
        "[rig]: subscription 'cam_0' (system.yaml:3) raised ValueError: two",
        '[rig]: rig heard tick 20',
        '[rig]: plain heard tick 20',
        '[other]: plain heard x',
        '[rig]: answered yes True',
        '[rig]: matched 1',
        '[rig]: destroyed',
    ):
        child.wait_for_line(line)
    assert not child.matching('tick 21')
    child.wait_for_line('[rig]: closed', times=2)
    assert not child.matching('resumed')
    # An edit elsewhere leaves them, also of this node.
    compose.write(SYSTEM.replace('period: 100', 'period: 99'), CODE)
    child.wait_for_line('reloaded in')
    answered = len(child.matching('answered'))
    child.wait_for_line('answered', times=answered + 3)
    # A node that is created again begins without them.
    child.lines.clear()
    compose.write(SYSTEM.replace('cam_0}', 'cam_1}\n    rosout: false'), CODE)
    child.wait_for_line('±1 node')
    child.wait_for_line('[rig]: rig heard tick 1')
    assert child.stop() == 0
