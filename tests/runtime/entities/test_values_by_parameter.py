"""Values that follow parameters, in systems that run and in scenarios."""

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_msgs.msg import String

from tests.running import Child, wait_for

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  imu:
    parameters:
      rate: {default: 0.001, minimum: 0.0001}
      prefix: left
      topics: [a]
    publishers:
      "{{ t }}":
        foreach: {t: {parameter: topics}}
        type: std_msgs/msg/String
        topic: {parameter: prefix, format: "/{}/{{ t }}"}
        external: true
    timers:
      "{{ t }}":
        foreach: {t: {parameter: topics}}
        rate: {parameter: rate}
        publish: "{{ t }}"
        message: "{{ t }}"
"""
FILE = """
imu:
  ros__parameters: {prefix: right, topics: [a, b]}
"""


def set_parameter(peer, **values):
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    (result,) = peer.call(
        SetParameters,
        '/imu/set_parameters',
        parameters=[each.to_parameter_msg() for each in parameters],
    ).results
    return result


def test_rates_follow_at_once_and_edits_change_the_rest(compose, peer, tmp_path):
    (tmp_path / 'imu.yaml').write_text(FILE)
    child = compose(SYSTEM, '', '--watch', '--ros-args', '--params-file', 'imu.yaml')
    child.wait_until_ready()
    heard = [peer.listen(String, topic) for topic in ('/right/a', '/right/b', '/other/c')]
    assert set_parameter(peer, rate=100.0).successful
    wait_for(lambda: all(len(each) > 10 for each in heard[:2]), 'messages at the new rate')
    for name, value in (('rate', 0.0), ('prefix', 'other'), ('topics', ['c'])):
        result = set_parameter(peer, **{name: value})
        assert not result.successful
        assert name in result.reason
    # Its parameter is not what the command line gives any more.
    text = SYSTEM.replace('parameter: prefix', 'parameter: place').replace(
        'prefix: left', 'prefix: left\n      place: other'
    )
    compose.write(text.replace('{parameter: topics}', '[c]'))
    child.wait_for_line('reloaded in')
    wait_for(lambda: len(heard[2]) > 10, 'messages of what the edit has added')
    assert child.stop() == 0, child.output
    assert {each.data for each in heard[2]} == {'c'}


SCENARIO = """
version: 1
system: {file: system.yaml}
cases:
  given:
    given: {parameters: {imu: {rate: 10.0, prefix: other}}}
    until: 1.05
    then: [{topic: /other/a, type: std_msgs/msg/String, count: 10}]
  set:
    given: {parameters: {imu: {rate: 10.0}}}
    when:
      - {at: 0.55, set_parameters: {imu: {rate: 100.0}}}
      - {at: 0.56, set_parameters: {imu: {prefix: other}}, refused: true}
    until: 1.0501
    then: [{topic: /left/a, count: 55}]
"""
LISTED = """
version: 1
system: {file: system.yaml}
cases:
  listed:
    given: {parameters: {imu: {topics: [b]}}}
    until: 1
    then: []
"""


def test_scenarios_follow_parameters_but_for_lists(compose, tmp_path, domain_id):
    compose.write(SYSTEM)
    (tmp_path / 'test.yaml').write_text(SCENARIO)
    (tmp_path / 'listed.yaml').write_text(LISTED)
    child = Child(['test', 'test.yaml', 'listed.yaml'], tmp_path, domain_id, tmp_path / 'log')
    try:
        assert child.wait() == 1
    finally:
        child.end()
    assert "entities are repeated for the values of 'topics'" in child.output
    assert '2 passed' in child.output, child.output
