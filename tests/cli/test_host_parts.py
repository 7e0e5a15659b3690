"""`--host`: the part of a system that one host runs, of a system that is read as a whole."""

from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest

from composer.application.system_reader import SystemReader
from composer.cli.main import run
from composer.errors import UsageError
from composer.language.values.start_reader import StartValueReader

# What is on the jetson is not here: modules, files, programs and packages.
ROBOT = """
    version: 1
    defaults: {host: base}
    workers: {eyes: {host: jetson}}
    nodes:
      camera:
        worker: eyes
        publishers: {image: std_msgs/msg/String}
        timers: {take: {period: 0.2, behaviour: jetson_only:take, publish: image}}
        parameters: {calibration: {file: absent.txt}, serial: {command: [no-such-program]}}
        parameter_files: [absent.yaml]
      lidar:
        host: jetson
        publishers: {scan: vendor_msgs/msg/Scan}
      detector:
        subscriptions: {image: {type: std_msgs/msg/String, behaviour: here:see}}
        parameters: {limit: {file: limit.txt, type: integer}}
    processes:
      driver: {host: jetson, package: vendor, executable: drive}
      own: {command: [sleep, '9']}
"""
HERE = 'def see(node, message):\n    node.logger.info(message.data[: node.parameters.limit])\n'


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read the system, with a text in place of another one, as a host does."""
    monkeypatch.chdir(tmp_path)
    Path('here.py').write_text(HERE)
    Path('limit.txt').write_text('7\n')

    def read(host, old='', new='', before=None):
        text = dedent(ROBOT)
        assert old in text
        Path('robot.yaml').write_text(text.replace(old, new, 1) if old else text)
        reader = SystemReader([Path('robot.yaml')], [], [], host, StartValueReader(host))
        context, _, findings = reader.read(before)
        return context, [(each.span.line, each.rule) for each in findings]

    return read


def test_what_runs_elsewhere_may_be_missing_here(read):
    context, findings = read('base')
    assert findings == []
    spec = context.spec
    assert (spec.host, spec.running_name) == ('base', 'robot@base')
    assert ([*spec.nodes], [*spec.processes], [*spec.workers]) == (['detector'], ['own'], [])
    assert spec.nodes['detector'].parameters['limit'].value == 7


def test_what_runs_here_must_be_here(read):
    _, findings = read('jetson')
    assert findings == [
        (9, 'unknown-behaviour'),
        (10, 'missing-file'),
        (10, 'missing-program'),
        (11, 'unreadable-file'),
        (14, 'unused-publisher'),
        (14, 'unknown-type'),
        (19, 'missing-package'),
    ]


# What is written wrong, and on which hosts it is told.
EDITS = {
    'a behaviour here': ('here:see', 'here:sea', {'base': [(16, 'unknown-behaviour')]}),
    'a type here': ('String, behaviour', 'Strin, behaviour', {'base': [(16, 'unknown-type')]}),
    # The two ends of a topic are on two hosts.
    'a type that others publish': (
        '{type: std_msgs/msg/String, behaviour: here:see}',
        '{type: std_msgs/msg/Int8, behaviour: here:see}',
        {'base': [(16, 'conflicting-types'), (16, 'wrong-type')]},
    ),
    'the file itself': (
        '  lidar:',
        '  lidar:\n    hots: x',
        {'base': [(13, 'unknown-key')]},
    ),
    'a node that others name': (
        '    host: jetson\n',
        '    host: jetson\n    wait_for: {process: onw}\n',
        {'base': [(14, 'unknown-process')]},
    ),
}


@pytest.mark.parametrize('name', EDITS)
def test_the_system_is_checked_as_a_whole(read, name):
    old, new, told = EDITS[name]
    for host, expected in told.items():
        _, findings = read(host, old, new)
        assert {each[1] for each in findings} >= {expected[0][1]}
        assert expected[0] in findings


def test_a_host_where_nothing_runs_is_refused(read):
    with pytest.raises(UsageError, match="--host jetsn: 'robot' has no such host") as error:
        read('jetsn')
    assert error.value.help == "did you mean 'jetson'?"
    with pytest.raises(UsageError, match="--host spare: no node or process of 'robot' runs there"):
        read('spare', 'version: 1', 'version: 1\nhosts: {spare: {}, base: {}, jetson: {}}')


def test_a_part_is_read_again_after_an_edit(read):
    before, _ = read('base')
    _, findings = read('base', 'worker: eyes', 'host: base', replace(before))
    assert (9, 'unknown-behaviour') in findings
    context, findings = read('base', "[sleep, '9']", "[sleep, '8']", replace(before))
    assert findings == []
    assert context.spec.nodes['detector'] is before.spec.nodes['detector']
    assert context.spec.processes['own'] is not before.spec.processes['own']


def test_a_plan_of_a_part_has_the_rest_come_and_go(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = 'version: 1\nnodes:\n  a: {host: x}\n  b: {host: y}\n'
    for folder, host in (('old', 'y'), ('new', 'x')):
        Path(folder).mkdir()
        Path(folder, 'robot.yaml').write_text(text.replace('b: {host: y}', f'b: {{host: {host}}}'))
    assert run(['plan', 'old/robot.yaml', 'new/robot.yaml']) == 0
    assert capsys.readouterr().out == 'robot: no difference\n'
    assert run(['plan', 'old/robot.yaml', 'new/robot.yaml', '--host', 'x']) == 0
    assert capsys.readouterr().out.splitlines()[0] == "+ node 'b' (new/robot.yaml:4)"
    assert run(['plan', 'old/robot.yaml', 'new/robot.yaml', '--host', 'z']) == 2
    assert '--host z' in capsys.readouterr().err
