"""`composer plan NEW`: what an edit would do to the running system of that name."""

import json
import re
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.application.file_selection import load_given
from composer.checks.checker import create_context
from composer.cli.main import run
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.language.values.start_reader import StartValueReader
from composer.planning import snapshot_data
from composer.planning.differences import compare
from composer.planning.snapshot_data import (
    conceal_both,
    conceal_snapshot,
    decode_snapshot,
    encode_snapshot,
)
from composer.planning.snapshot_taking import take_snapshot
from composer.planning.text import render_plan
from tests.running import ROOT

SYSTEM = """
version: 1
nodes:
  arm:
    state: {poses: {first: [0.5, null]}}
    parameters: {speed: 1.5, token: "{{ env('COMPOSER_SECRET') }}"}
    parameter_files: [arm.yaml.params]
    timers:
      tick: {period: 0.05, behaviour: parts:tick, with: {times: 3}}
"""
CODE = """
def tick(node, times):
    print(node.state.poses, node.parameters.speed, node.parameters.token)
"""


def snapshot_of(path):
    system = load_system(path)
    return take_snapshot(create_context(system, InterfaceCatalogue()))


@pytest.mark.parametrize('name', ['robot', 'cell', 'patrol', 'sensors', 'self_contained'])
def test_a_snapshot_is_the_same_after_its_journey(name, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = Path('configs', f'{name}.yaml')
    snapshot = snapshot_of(path)
    sent = json.loads(json.dumps(encode_snapshot(snapshot)))
    here = decode_snapshot(sent)
    again = decode_snapshot(encode_snapshot(snapshot_of(path)))
    assert not compare(here, again)
    assert repr(here.spec.nodes) == repr(snapshot.spec.nodes)
    assert [*here.spec.nodes] == [*snapshot.spec.nodes]
    assert {at: span.place for at, span in here.positions.keys.items()} == {
        at: span.place for at, span in snapshot.positions.keys.items()
    }


@pytest.mark.parametrize('data', [{}, {'files': []}, {'files': [['a', None]], 'spec': ['os', {}]}])
def test_what_is_no_snapshot_is_refused(data):
    from composer.errors import ComposerError

    with pytest.raises(ComposerError, match='in a form that is not known here'):
        decode_snapshot(data)


@pytest.mark.ros
def test_files_are_compared_with_the_running_system(compose, capsys, monkeypatch, peer):
    from std_srvs.srv import Trigger

    def plan(*words):
        code = run(['plan', str(path), *words])
        output, errors = capsys.readouterr()
        return code, output.replace(f'{compose.folder}/', ''), errors

    path = compose.folder / 'system.yaml'
    (compose.folder / 'arm.yaml.params').write_text('arm: {ros__parameters: {speed: 2.5}}')
    monkeypatch.setenv('COMPOSER_SECRET', 'swordfish')
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    assert plan('--exit-code') == (0, 'system: no difference\n', '')
    path.write_text(SYSTEM.replace('0.05', '0.1').replace('times: 3', 'times: 4'))
    (compose.folder / 'arm.yaml.params').write_text('arm: {ros__parameters: {speed: 3.5}}')
    code, output, _ = plan('--exit-code')
    assert code == 2
    assert re.sub(r'yaml\S*:\d+', 'yaml', output) == (
        "~ parameter 'speed' of 'arm': value 2.5 → 3.5 (arm.yaml)\n"
        "~ timer 'tick' of 'arm': period 0.05 → 0.1 (system.yaml), with.times 3 → 4 (system.yaml)\n"
        'system: 2 to change\n'
    )
    answer = peer.call(Trigger, '/_composer_system/snapshot')
    assert 'swordfish' not in answer.message
    assert 'def tick' not in answer.message
    assert child.stop() == 0
    code, _, errors = plan()
    assert code == 1
    assert errors.startswith("error: there is no system 'system' on this ROS graph")


@pytest.mark.ros
def test_a_file_is_read_as_the_running_system_was(compose, capsys):
    """Its arguments, without which it may not even be readable, its layers and its settings."""
    text = """
        version: 1
        args: {robots: {type: integer}, rate: 1.0}
        nodes:
          more: {}
          "robot_{{ i }}":
            foreach: {i: "{{ range(robots) }}"}
            timers: {tick: {rate: "{{ rate }}", behaviour: parts:tick}}
    """
    path = compose.write(text, 'def tick(node):\n    pass\n')
    layer = compose.folder / 'site.yaml'
    layer.write_text('nodes: {more: {parameters: {speed: 1.0}}}')
    setting = 'nodes.more.parameters.speed=2.0'
    child = compose.run(path.name, layer.name, 'robots:=1', '--set', setting)
    child.wait_until_ready()

    def plan(*words):
        assert run(['plan', str(path), *words]) == 0
        return capsys.readouterr().out

    assert plan() == 'system: no difference\n'
    assert plan('robots:=2').endswith('system: 1 to add\n')
    assert plan('rate:=2.0').endswith('system: 1 to change\n')
    assert plan('--set', 'nodes.more.parameters.speed=3.0').endswith('system: 1 to change\n')
    assert child.stop() == 0


SECRETS = """\
version: 1
environment: {TOKEN: s3cr3t-1, PIN: {file: pin.txt}}
args:
  pin: {file: pin.txt}
  code: {command: [cat, pin.txt]}
  token: {default: "{{ env('COMPOSER_SECRET') }}"}
vars: {head: "Bearer {{ pin }}"}
nodes:
  n:
    state: {pin: "{{ pin }}", more: [{other: "{{ token }}"}]}
    parameters:
      a: {file: pin.txt}
      b: {file: pin.txt, description: a pin}
      c: "{{ head }}"
      d: "{{ code[:8] }}"
      e: "{{ token | upper }}"
processes:
  p: {command: [sh], env: {TOKEN: s3cr3t-2, OTHER: {command: [cat, pin.txt]}}}
  o: {command: [sh, -c, "echo {{ head }}", "--pin={{ code }}"], cwd: "{{ token }}"}
  q: {package: demo_nodes_cpp, executable: talker, parameters: {c: {file: pin.txt}}}
"""


def test_a_snapshot_tells_that_secrets_change_but_not_what_they_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('COMPOSER_SECRET', 's3cr3t-6')

    def snapshot_with(pin, text):
        Path('pin.txt').write_text(pin)
        Path('a.yaml').write_text(text)
        system = load_given([Path('a.yaml')], (), (), None, StartValueReader())
        return take_snapshot(create_context(system, InterfaceCatalogue()))

    old = snapshot_with('s3cr3t-3', SECRETS)
    same = conceal_snapshot(snapshot_with('s3cr3t-3', SECRETS))
    new = snapshot_with('s3cr3t-4', SECRETS.replace('s3cr3t-2', 's3cr3t-5'))

    sent = json.dumps(encode_snapshot(old))
    for text in (sent, json.dumps(encode_snapshot(new))):
        assert 's3cr3t' not in text.lower()
    assert not compare(conceal_snapshot(old), same)
    plan = compare(conceal_snapshot(old), conceal_snapshot(new))
    assert 's3cr3t' not in render_plan(plan)
    keys = {(each.name, change.key) for each in plan.operations for change in each.changes}
    assert keys == {
        ('a', 'environment.PIN'),
        ('a', 'default'),
        ('b', 'default'),
        ('c', 'default'),
        ('d', 'default'),
        ('n', 'state.pin'),
        ('o', 'command'),
        ('p', 'env.TOKEN'),
        ('p', 'env.OTHER'),
        ('q', 'parameters.c'),
    }
    before, after = conceal_both(sent, new)
    assert render_plan(compare(before, after)) == render_plan(plan)
    monkeypatch.setattr(snapshot_data, 'user_key', lambda: b'of another user')
    assert sent != json.dumps(encode_snapshot(old))
    assert not compare(*conceal_both(sent, new))


def test_the_key_of_a_user_is_made_once_and_is_not_for_others(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_STATE_HOME', str(tmp_path))
    keys = {snapshot_data.user_key.__wrapped__() for _ in range(2)}
    assert [len(each) for each in keys] == [32]
    (path,) = (tmp_path / 'composer').iterdir()
    assert path.stat().st_mode & 0o777 == 0o600
    monkeypatch.setenv('XDG_STATE_HOME', '/dev/null')
    assert snapshot_data.user_key.__wrapped__() not in keys
