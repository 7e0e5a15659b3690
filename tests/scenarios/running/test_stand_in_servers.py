"""Stand-ins of a case: one that never answers leaves nothing behind."""

import pytest

from composer.cli.main import run

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes:
  robot:
    service_clients:
      dock: {type: std_srvs/srv/SetBool, external: true}
    timers:
      tick: {period: 1, behaviour: moves:tick}
"""
MOVES = """\
def tick(node):
    answer = node.call('dock', {'data': True}, timeout=0.5)
    node.logger.info(f'docked: {answer.success}')
"""
CASES = """\
version: 1
system: {file: robot.yaml}
until: 4
cases:
  nobody docks:
    given: {services: {/dock: {answers: false}}}
    then:
      - {error: robot, matches: did not answer within 0.5 s, count: 4}
  it docks later:
    given: {services: {/dock: {response: {success: "{{ request.data }}"}, delay: 0.25}}}
    then:
      - {log: robot, text: 'docked: True', within: [1.25, 1.25]}
"""


def test_calls_without_an_answer_time_out_also_while_the_system_stops(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    for name, text in (('robot.yaml', SYSTEM), ('moves.py', MOVES), ('a.scenario.yaml', CASES)):
        (tmp_path / name).write_text(text)
    assert run(['test', 'a.scenario.yaml']) == 0
    assert '2 passed' in capfd.readouterr().out
