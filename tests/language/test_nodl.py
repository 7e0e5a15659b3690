"""NoDL documents become declarations of what external processes have."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.language.specs import DeclaredEndSpec

YAML = """\
nodl_version: 2
description: A camera.
include: [{ref: 'local://common.nodl.yaml'}]
publishers:
  - name: ~/image
    type: sensor_msgs/msg/Image
    qos: {history: KEEP_LAST, depth: 1, reliability: BEST_EFFORT, deadline_ns: 500000000}
service_servers: [{name: ~/enable, type: std_srvs/srv/SetBool}]
action_clients: [{name: /move, type: test_msgs/action/Fibonacci}]
parameters:
  rate: {type: double, default_value: 1.0, validation: {bounds<>: [0.5, 60.0]}}
  mode: {type: string, default_value: fast, validation: {one_of<>: [[fast, slow]]}}
  size: {type: int_array_fixed_2, default_value: [640, 480]}
"""
COMMON = """\
nodl_version: 2
subscriptions:
  - {name: trigger, type: std_msgs/msg/Empty, qos: {history: KEEP_ALL, reliability: RELIABLE}}
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Return a function that reads a process, beside documents, and returns it with findings."""
    monkeypatch.chdir(tmp_path)

    def run(process, nodes='{}', **documents):
        for name, text in {'camera.nodl.yaml': YAML, **documents}.items():
            (tmp_path / name).write_text(text)
        (tmp_path / 'common.nodl.yaml').write_text(COMMON)
        path = tmp_path / 'robot.yaml'
        text = (
            f'version: 1\nnodes: {nodes}\nprocesses:\n  camera: {{command: ["true"], {process}}}\n'
        )
        path.write_text(text)
        system = load_system(path)
        findings = check_system(system, InterfaceCatalogue())
        return system.spec.processes['camera'], [
            each for each in findings if each.rule != 'missing-program'
        ]

    return run


def ends(process):
    return {
        (node.full_name, kind.section, end.channel, end.type)
        for node in process.nodes
        for kind, end in node.ends()
        if isinstance(end, DeclaredEndSpec)
    }


def test_a_document_has_one_node_with_qos_and_limits(load):
    process, findings = load('name: front, nodl: camera.nodl.yaml, parameters: {rate: 70.0}')
    assert [each.rule for each in findings] == ['refused-parameter']
    assert ends(process) == {
        ('/front', 'publishers', '~/image', 'sensor_msgs/msg/Image'),
        ('/front', 'subscriptions', 'trigger', 'std_msgs/msg/Empty'),
        ('/front', 'services', '~/enable', 'std_srvs/srv/SetBool'),
        ('/front', 'action_clients', '/move', 'test_msgs/action/Fibonacci'),
    }
    (node,) = process.nodes
    image = node.sections['publishers']['~/image']
    assert image.qos.policies == {
        'history': 'keep_last',
        'depth': 1,
        'reliability': 'best_effort',
        'deadline': 0.5,
    }
    assert node.parameters['size'].type == 'integer_array'
    assert node.parameters['mode'].choices == ('fast', 'slow')


def test_values_in_a_document_are_not_given_to_the_program(load):
    process, findings = load('nodl: camera.nodl.yaml, parameters: {mode: slow}')
    assert not findings
    assert process.parameters == {'mode': 'slow'}
    assert process.declares_all_ends


def test_a_node_of_a_process_may_have_a_document_and_what_the_file_says_wins(load):
    publishers = "{'~/image': std_msgs/msg/Empty}"
    nodes = f'{{camera: {{nodl: camera.nodl.yaml, publishers: {publishers}}}, other: {{}}}}'
    process, findings = load(f'nodes: {nodes}')
    assert not findings
    assert ('/camera', 'publishers', '~/image', 'std_msgs/msg/Empty') in ends(process)
    assert ('/camera', 'services', '~/enable', 'std_srvs/srv/SetBool') in ends(process)


def test_a_finding_has_the_place_in_the_document(load):
    nodes = (
        '{a: {publishers: {trigger: std_msgs/msg/String}, timers: '
        '{t: {rate: 1, publish: trigger, message: {}}}}}'
    )
    _, (finding,) = load('nodl: camera.nodl.yaml', nodes)
    assert finding.rule == 'conflicting-types'
    places = [str(finding.span), *(str(each.span) for each in finding.related)]
    assert any(place.endswith('common.nodl.yaml:3:27') for place in places), places


XML = '<interface version="1"><node name="n" executable="e" /></interface>'


@pytest.mark.parametrize(
    ('process', 'documents'),
    [
        ('nodl: old.nodl.xml', {'old.nodl.xml': XML}),
        ('nodl: old', {'old': f'\ufeff\n<?xml version="1.0"?>{XML}'}),
        ('nodes: {a: {nodl: old}}', {'old': f'<!-- old -->{XML}'}),
        (
            'nodl: new.yaml',
            {'old': XML, 'new.yaml': "nodl_version: 2\ninclude: [{ref: 'local://old'}]"},
        ),
    ],
)
def test_a_document_of_version_1_is_one_error(load, process, documents):
    _, (finding,) = load(process, **documents)
    assert finding.rule == 'bad-nodl'
    assert 'is NoDL of version 1 (XML), and only version 2 (YAML) is read' in finding.message
    assert finding.span is not None
    assert 'nodl_version: 2' in finding.help


@pytest.mark.parametrize(
    ('old', 'new', 'said'),
    [
        ('nodl_version: 2', 'nodl_version: 1', 'nodl_version: 2'),
        ('publishers:', 'publisher:', "did you mean 'publishers'?"),
        ('BEST_EFFORT', '5', 'no QoS of NoDL'),
        ('deadline_ns', 'deadlin_ns', "did you mean 'deadline_ns'?"),
        ('local://common', 'local://other', 'there is no NoDL document'),
        ('local://common', 'local://bad', 'includes itself'),
        ('int_array_fixed_2', 'ints', 'is not a type'),
        ('{name: ~/enable, type', '{nam: ~/enable, type', "has 'name' and 'type'"),
    ],
)
def test_a_mistake_is_found(load, old, new, said):
    _, findings = load('nodl: bad.nodl.yaml', **{'bad.nodl.yaml': YAML.replace(old, new, 1)})
    assert {each.rule for each in findings} == {'bad-nodl'}
    texts = [f'{each.message} {each.help}' for each in findings]
    assert any(said in text for text in texts), texts


@pytest.mark.parametrize(
    ('process', 'rule', 'said'),
    [
        ('nodl: camra.nodl.yaml', 'bad-nodl', "did you mean 'camera.nodl.yaml'?"),
        ('nodl: package://nowhere/x.xml', 'uninstalled-package', 'nowhere'),
        ('nodl: common.nodl.yaml, nodes: {a: {nodl: nothing.xml}}', 'bad-nodl', 'nothing.xml'),
    ],
)
def test_a_document_that_is_not_there_is_an_error(load, process, rule, said):
    _, findings = load(process)
    assert [each.rule for each in findings] == [rule]
    assert said in f'{findings[0].message} {findings[0].help}'
