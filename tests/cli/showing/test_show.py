"""`composer show`."""

import json
import re
import textwrap
from pathlib import Path

import pytest

from composer.cli.main import run

ROBOT = """
    version: 1
    args: {arms: 2, side: {type: string, default: left}}
    x-anchors: {depth: 5}
    include:
      arm: {file: parts/arm.yaml, namespace: arm, args: {joints: "{{ arms }}"}}
    nodes:
      brain: {when: "{{ side == 'left' }}", description: "{{ side }} brain"}
      other: {when: "{{ side != 'left' }}"}
"""
ARM = """
    version: 1
    args: {joints: {type: integer}}
    interfaces: {my_msgs: msgs}
    nodes:
      "joint_{{ j }}": {foreach: {j: "{{ range(joints) }}"}, parameters: {index: "{{ j }}"}}
"""


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'parts').mkdir()
    (tmp_path / 'robot.yaml').write_text(textwrap.dedent(ROBOT).lstrip())
    (tmp_path / 'parts' / 'arm.yaml').write_text(textwrap.dedent(ARM).lstrip())
    return tmp_path


def test_it_prints_the_final_system(robot, capsys):
    assert run(['show', 'robot.yaml', 'arms:=1']) == 0
    assert capsys.readouterr().out == textwrap.dedent(
        f"""\
        version: 1
        nodes:
          brain:
            description: "left brain"
          joint_0:
            namespace: arm
            parameters:
              index: 0
        interfaces:
          my_msgs: {robot}/parts/msgs
        """
    )


def test_what_it_prints_is_the_same_system_elsewhere(robot, capsys, tmp_path_factory):
    run(['show', 'robot.yaml'])
    first = capsys.readouterr().out
    path = tmp_path_factory.mktemp('elsewhere') / 'flat.yaml'
    path.write_text(first)
    run(['show', str(path)])
    assert capsys.readouterr().out == first


def test_it_prints_json(robot, capsys):
    run(['show', 'robot.yaml', '--format', 'json'])
    assert list(json.loads(capsys.readouterr().out)['nodes']) == ['brain', 'joint_0', 'joint_1']


def test_it_says_where_each_value_comes_from(robot, capsys):
    (robot / 'site.yaml').write_text('nodes: {brain: {log_level: debug}}\n')
    arguments = ['show', 'robot.yaml', 'site.yaml', 'arms:=1', '--origin']
    run([*arguments, '--set', 'nodes.brain.use_sim_time=true'])
    origins = dict(
        (part.strip() for part in line.split('  # '))
        for line in capsys.readouterr().out.splitlines()
        if '  # ' in line
    )
    assert origins == {
        'version: 1': 'robot.yaml:1',
        'description: "left brain"': 'robot.yaml:7, side = left (default, robot.yaml:2)',
        'log_level: debug': 'site.yaml:1',
        'use_sim_time: true': '--set nodes.brain.use_sim_time=true',
        'namespace: arm': 'robot.yaml:5',
        'index: 0': 'parts/arm.yaml:5, j = 0 (foreach)',
        f'my_msgs: {robot}/parts/msgs': 'parts/arm.yaml:3',
    }


def test_it_lists_the_arguments(robot, capsys):
    assert run(['show', 'robot.yaml', '--args']) == 0
    assert capsys.readouterr().out == (
        'the file declares\n  arms (integer, default 2)\n  side (string, default left)\n'
    )


def test_a_invalid_file_is_not_shown(robot, capsys):
    (robot / 'robot.yaml').write_text('version: 1\nnodes: {n: {log_levl: debug}}\n')
    assert run(['show', 'robot.yaml']) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert 'unknown-key' in captured.err


SILENCED = """
version: 1
include:
  "{{ side }}": {foreach: {side: [left, right]}, file: part.yaml, namespace: "{{ side }}"}
nodes:
  talker:
    publishers:
      news:  # composer: ignore[no-subscription, incompatible-qos]
        type: std_msgs/msg/String
      fast:
        type: std_msgs/msg/String
        qos: {reliability: best_effort}  # composer: ignore[incompatible-qos]
    timers:
      tell: {period: 1.0, publish: news, message: {data: x}}  # composer: ignore[unknown-behaviour]
      tell_fast: {period: 1.0, publish: fast, message: {data: x}}
  listener:
    subscriptions: {fast: {type: std_msgs/msg/String, publish: copy}}
    publishers: {copy: {type: std_msgs/msg/String, external: true}}
"""
PART = """
version: 1
nodes:
  only:
    publishers: {lonely: std_msgs/msg/String}  # composer: ignore[no-subscription]
    timers: {tell: {period: 1.0, publish: lonely, message: {data: x}}}
"""


@pytest.fixture
def silenced(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text(SILENCED.lstrip())
    (tmp_path / 'part.yaml').write_text(PART.lstrip())


def test_what_is_silenced_remains_so(silenced, capsys):
    assert run(['show', 'robot.yaml']) == 0
    shown = capsys.readouterr().out
    assert re.findall(r'(\S+)(?: \S+)?  # composer: ignore\[(.*)\]', shown) == [
        ('news:', 'no-subscription'),
        ('reliability:', 'incompatible-qos'),
        ('lonely:', 'no-subscription'),
        ('lonely:', 'no-subscription'),
    ]
    Path('flat.yaml').write_text(shown)
    assert run(['check', '--strict', 'flat.yaml']) == 0
    assert capsys.readouterr().out.startswith('flat.yaml: ok')
    assert run(['show', 'flat.yaml']) == 0
    assert capsys.readouterr().out == shown


def test_origins_stand_before_what_is_silenced(silenced, capsys):
    assert run(['show', '--origin', 'robot.yaml']) == 0
    (line,) = [each for each in capsys.readouterr().out.splitlines() if 'best_effort' in each]
    assert line.split('  # ')[1:] == ['robot.yaml:11', 'composer: ignore[incompatible-qos]']
