"""Behaviours that are methods: one instance of the class for each node, made with it."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
defaults: {parameter_services: false}
nodes:
  "n{{ i }}":
    foreach: {i: [1, 2]}
    parameters: {name: "number {{ i }}"}
    publishers: {words: std_msgs/msg/String, "more{{ i }}": {type: std_msgs/msg/String}}
    timers:
      say: {period: 0.05, behaviour: 'parts:Talker.say', publish: words}
      steps: {period: 0.05, behaviour: 'parts:Talker.steps', publish: "more{{ i }}"}
    subscriptions:
      words: {topic: "more{{ i }}", type: std_msgs/msg/String, behaviour: 'parts:Talker.hear'}
    on_start: parts:Talker.begin
    on_parameters: parts:Talker.decide
"""
CODE = """\
class Talker:
    def __init__(self, node):
        self.node = node
        self.name = node.parameters.name
        self.said = self.stepped = 0
        node.publish('words', 'made')
        node.logger.info(f'made with {self.name}')

    def begin(self, node):
        node.logger.info(f'begun as {self.name}')

    def decide(self, node, changes):
        return f'{self.name} is fixed'

    def say(self, node):
        self.said += 1
        return self.name

    def steps(self, node):
        for self.stepped in range(1, 1000):
            yield str(self.stepped)

    async def hear(self, node, message):
        node.logger.info(f'{self.name} heard {message.data} of {self.stepped}, said {self.said > 0}')
"""


def test_a_node_has_one_instance_and_another_one_with_new_code(compose):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    for number in (1, 2):
        assert child.wait_for_line(f'[n{number}]: made with number {number}')
        child.wait_for_line(f'[n{number}]: begun as number {number}')
        child.wait_for_line(f'number {number} heard 5 of 5, said True')
    assert len(child.matching('made with')) == 2
    compose.write(SYSTEM, CODE.replace('begun as', 'begun again as'))
    child.wait_for_line('±2 nodes')
    for number in (1, 2):
        child.wait_for_line(f'[n{number}]: begun again as number {number}')
    assert len(child.matching('made with number')) == 4
    # It cannot be made: everything is as before.
    compose.write(SYSTEM, CODE.replace('self.node = node', 'self.node = 1 / 0'))
    told = child.wait_for_line('not reloaded')
    assert "node 'n1': Talker.__init__ raised ZeroDivisionError: division by zero" in told
    assert child.stop() == 0
