"""A recording as what a case is given, and as what is expected of a topic."""

import pytest

from tests.recorded import write_recording

pytestmark = pytest.mark.ros

SYSTEM = """
    version: 1
    nodes:
      echo:
        publishers: {out: {type: std_msgs/msg/String, external: true}}
        subscriptions: {in: {type: std_msgs/msg/String, external: true, publish: out}}
"""


def strings(*texts):
    from std_msgs.msg import String

    return [String(data=each) for each in texts]


def test_what_the_system_hears_comes_at_its_times(project, run_json):
    project.write('system.yaml', SYSTEM)
    # What it publishes itself is left out, and what it does not hear.
    recorded = {'/in': strings('a', 'b'), '/out': strings('x'), '/other': strings('y')}
    write_recording(project.folder / 'in.mcap', recorded)
    write_recording(project.folder / 'out.mcap', {'/out': strings('a', 'b')})
    write_recording(project.folder / 'wrong.mcap', {'/out': strings('a', 'c')})
    case = '{given: {recording: ../in.mcap}, then: [{topic: /out, like: ../%s.mcap}]}'
    project.scenario(f'same: {case % "out"}\nother: {case % "wrong"}\n')
    code, report = run_json('--trace', 'trace')
    assert code == 1
    same, other = report['cases']
    assert same['failures'] == []
    assert any('c' in line for line in other['failures'][0]['difference'])
    lines = (project.folder / 'trace').read_text().splitlines()
    heard = lines[: lines.index('# tests/worker.scenario.yaml::other seed 0')]
    published = [line for line in heard if ' message - ' in line]
    assert [line.split(' ', 1)[0] for line in published] == ['0.000000000', '0.000000001']
    assert {line.split()[3] for line in published} == {'/in'}
