"""Layers change nodes of includes by their full names, in all that is made of the system."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

FILES = {
    'site.yaml': 'version: 1\ninclude: {fleet: {file: fleet.yaml, namespace: site}}\n',
    'fleet.yaml': """\
version: 1
include:
  "robot_{{ i }}":
    {foreach: {i: [0, 1]}, file: robot.yaml, namespace: "robot_{{ i }}", args: {rate: 10}}
""",
    'robot.yaml': """\
version: 1
args: {rate: 1, inner: base}
defaults: {namespace: "{{ inner }}"}
nodes:
  lidar:
    parameters: {limit: 1.0}
    publishers: {scan: {type: std_msgs/msg/String, external: true}}
    timers: {tick: {rate: "{{ rate }}", behaviour: parts:tick, publish: scan}}
""",
    'parts.py': 'def tick(node):\n    return str(node.parameters["limit"])\n\ntock = tick\n',
}


@pytest.fixture
def load(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)

    def load(file, *layers):
        paths = []
        for index, text in enumerate(layers):
            paths.append(tmp_path / f'layer{index}.yaml')
            paths[-1].write_text(text)
        return load_system(tmp_path / file, layers=paths)

    return load


def described(system):
    return {
        node.full_name: (
            node.worker,
            node.parameters['limit'].value,
            node.timers['tick'].period_sec,
            node.timers['tick'].behaviour.name,
        )
        for node in system.spec.nodes.values()
    }


PLAIN = ('', 1.0, 0.1, 'parts:tick')
CHANGE = """\
workers: {vision: {}}
nodes:
  /robot_0/base/lidar:
    worker: vision
    parameters: {limit: 2.5}
    timers: {tick: {behaviour: parts:tock, rate: null, period: 0.5}}
"""


@pytest.mark.parametrize(('file', 'prefix'), [('fleet.yaml', ''), ('site.yaml', '/site')])
def test_one_of_several_includes_is_changed(load, file, prefix):
    system = load(file, CHANGE.replace('/robot', f'{prefix}/robot'))
    assert described(system) == {
        f'{prefix}/robot_0/base/lidar': ('vision', 2.5, 0.5, 'parts:tock'),
        f'{prefix}/robot_1/base/lidar': PLAIN,
    }
    assert not check_system(system, InterfaceCatalogue())


def test_layers_change_what_layers_say_and_repeat_it(load):
    above = 'nodes: {/robot_0/base/lidar: {worker: null, parameters: {limit: 3.5}}}'
    both = 'nodes: {"/robot_{{ i }}/base/lidar": {foreach: {i: [0, 1]}, parameters: {limit: 4.5}}}'
    changed = described(load('fleet.yaml', CHANGE, above))
    assert changed['/robot_0/base/lidar'] == ('', 3.5, 0.5, 'parts:tock')
    assert {each[1] for each in described(load('fleet.yaml', both)).values()} == {4.5}


def test_a_node_of_its_own_may_stand_beside(load):
    own = (
        CHANGE + '  /robot_0/own: {subscriptions: {scan: {type: std_msgs/msg/String, publish: x}}}'
    )
    system = load('fleet.yaml', own.replace('publish: x', 'behaviour: parts:tick'))
    assert sorted(each.full_name for each in system.spec.nodes.values())[1] == '/robot_0/own'


@pytest.mark.parametrize(
    ('change', 'expected', 'help'),
    [
        (
            '/robot_0/base/lidr: {worker: x}',
            "there is no node '/robot_0/base/lidr' to change",
            "did you mean '/robot_0/base/lidar'?",
        ),
        (
            '/robot_0/base/lidar: {timers: {tikc: {behaviour: parts:tock}}}',
            "there is no timer 'tikc' to change, and for a new one keys are missing",
            "did you mean 'tick'?",
        ),
        ('/robot_0/base/lidar: {worker: null}', "null removes 'worker'", 'there are'),
        ('/robot_0/base/lidar: {wroker: x}', "unknown key 'wroker'", "did you mean 'worker'?"),
    ],
)
def test_what_meets_nothing_is_a_finding(load, change, expected, help):  # noqa: A002
    findings = load('fleet.yaml', f'nodes:\n  {change}\n').diagnostics
    assert [(expected in each.message, help in (each.help or '')) for each in findings] == [
        (True, True)
    ]
    assert findings[0].file.endswith('layer0.yaml')
