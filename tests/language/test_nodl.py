"""NoDL documents become declarations of what external processes have."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.language.specs import DeclaredEndSpec

XML = """\
<interface version="1">
  <node name="camera" executable="driver">
    <topic name="~/image" type="sensor_msgs/Image" role="publisher" />
    <topic name="trigger" type="std_msgs/msg/Empty" role="both" />
    <service name="~/enable" type="std_srvs/srv/SetBool" role="both" />
    <action name="/move" type="test_msgs/action/Fibonacci" role="client" />
    <parameter name="rate" type="double" />
    <parameter name="names" type="str_array" />
  </node>
  <node name="rectifier" executable="rectify">
    <topic name="image" type="sensor_msgs/msg/Image" role="subscription" />
  </node>
</interface>
"""
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

    def run(process, nodes='{}', *, command='true', **documents):
        for name, text in {'camera.nodl.xml': XML, 'camera.nodl.yaml': YAML, **documents}.items():
            (tmp_path / name).write_text(text)
        (tmp_path / 'common.nodl.yaml').write_text(COMMON)
        path = tmp_path / 'robot.yaml'
        text = f'version: 1\nnodes: {nodes}\nprocesses:\n  camera: {{command: [{command}], {process}}}\n'
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


def test_xml_has_the_nodes_of_a_package(load):
    process, findings = load('nodl: camera.nodl.xml, namespace: /left')
    assert not findings
    assert process.declares_all_ends
    assert ends(process) == {
        ('/left/camera', 'publishers', '~/image', 'sensor_msgs/msg/Image'),
        ('/left/camera', 'publishers', 'trigger', 'std_msgs/msg/Empty'),
        ('/left/camera', 'subscriptions', 'trigger', 'std_msgs/msg/Empty'),
        ('/left/camera', 'services', '~/enable', 'std_srvs/srv/SetBool'),
        ('/left/camera', 'service_clients', '~/enable', 'std_srvs/srv/SetBool'),
        ('/left/camera', 'action_clients', '/move', 'test_msgs/action/Fibonacci'),
        ('/left/rectifier', 'subscriptions', 'image', 'sensor_msgs/msg/Image'),
    }
    types = {name: each.type for name, each in process.nodes[0].parameters.items()}
    assert types == {'rate': 'double', 'names': 'string_array'}


def test_the_node_of_the_program_is_taken_and_has_the_name_of_the_process(load):
    process, _ = load('name: front, nodl: camera.nodl.xml', command='./rectify')
    assert ends(process) == {('/front', 'subscriptions', 'image', 'sensor_msgs/msg/Image')}


def test_yaml_has_one_node_with_qos_and_limits(load):
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
    nodes = f'{{camera: {{nodl: camera.nodl.xml, publishers: {publishers}}}, other: {{}}}}'
    process, findings = load(f'nodes: {nodes}')
    assert not findings
    assert ('/camera', 'publishers', '~/image', 'std_msgs/msg/Empty') in ends(process)
    assert ('/camera', 'publishers', '~/image', 'sensor_msgs/msg/Image') not in ends(process)


def test_a_finding_has_the_place_in_the_document(load):
    nodes = (
        '{a: {publishers: {image: std_msgs/msg/Empty}, timers: '
        '{t: {rate: 1, publish: image, message: {}}}}}'
    )
    _, (finding,) = load('nodl: camera.nodl.xml', nodes)
    assert finding.rule == 'conflicting-types'
    places = [str(finding.span), *(str(each.span) for each in finding.related)]
    assert any(place.endswith('camera.nodl.xml:11:31') for place in places), places


@pytest.mark.parametrize(
    ('old', 'new', 'line', 'said'),
    [
        ('role="both"', 'role="bth"', 4, "did you mean 'both'?"),
        ('sensor_msgs/Image', 'sensor_msgs', 3, 'package/msg/Name'),
        ('type="double"', 'type="doubl"', 7, "did you mean 'double'?"),
        ('<parameter name="rate"', '<parameter nam="rate"', 7, "lacks the attribute 'name'"),
        ('<topic', '<topc', 3, "did you mean 'topic'?"),
        ('version="1"', 'version="3"', 1, 'version'),
        ('<interface version="1">', '<!DOCTYPE x [<!ENTITY a "b">]><interface>', 1, 'DOCTYPE'),
        ('</node>', '', 13, 'not XML: mismatched tag'),
        ('"trigger"', '"~/image"', 4, 'already'),
    ],
)
def test_a_mistake_in_xml_is_found(load, old, new, line, said):
    text = XML.replace(
        'type="std_msgs/msg/Empty" role="both"', 'type="std_msgs/Empty" role="both"'
    )
    assert old in text
    _, findings = load('nodl: bad.xml', **{'bad.xml': text.replace(old, new, 1)})
    texts = [
        f'{each.span.line}: {each.message} {each.help}'
        for each in findings
        if each.rule == 'bad-nodl'
    ]
    assert any(text.startswith(f'{line}: ') and said in text for text in texts), texts


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
def test_a_mistake_in_yaml_is_found(load, old, new, said):
    _, findings = load('nodl: bad.nodl.yaml', **{'bad.nodl.yaml': YAML.replace(old, new, 1)})
    assert {each.rule for each in findings} == {'bad-nodl'}
    texts = [f'{each.message} {each.help}' for each in findings]
    assert any(said in text for text in texts), texts


@pytest.mark.parametrize(
    ('process', 'rule', 'said'),
    [
        ('nodl: camra.nodl.xml', 'bad-nodl', "did you mean 'camera.nodl.xml'?"),
        ('nodl: package://nowhere/x.xml', 'uninstalled-package', 'nowhere'),
        ('nodl: common.nodl.yaml, nodes: {a: {nodl: nothing.xml}}', 'bad-nodl', 'nothing.xml'),
    ],
)
def test_a_document_that_is_not_there_is_an_error(load, process, rule, said):
    _, findings = load(process)
    assert [each.rule for each in findings] == [rule]
    assert said in f'{findings[0].message} {findings[0].help}'
