"""NoDL documents become declarations of what external processes have."""

import pytest

from composer.checks.checker import check_system
from composer.cli.main import run
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
    process, findings = load('name: front, interface: camera.nodl.yaml, parameters: {rate: 70.0}')
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
    process, findings = load('interface: camera.nodl.yaml, parameters: {mode: slow}')
    assert not findings
    assert process.parameters == {'mode': 'slow'}
    assert process.declares_all_ends


def test_a_node_of_a_process_may_have_a_document_and_what_the_file_says_wins(load):
    publishers = "{'~/image': std_msgs/msg/Empty}"
    nodes = f'{{camera: {{interface: camera.nodl.yaml, publishers: {publishers}}}, other: {{}}}}'
    process, findings = load(f'nodes: {nodes}')
    assert not findings
    assert ('/camera', 'publishers', '~/image', 'std_msgs/msg/Empty') in ends(process)
    assert ('/camera', 'services', '~/enable', 'std_srvs/srv/SetBool') in ends(process)


def test_a_finding_has_the_place_in_the_document(load):
    nodes = (
        '{a: {publishers: {trigger: std_msgs/msg/String}, timers: '
        '{t: {rate: 1, publish: trigger, message: {}}}}}'
    )
    _, (finding,) = load('interface: camera.nodl.yaml', nodes)
    assert finding.rule == 'conflicting-types'
    places = [str(finding.span), *(str(each.span) for each in finding.related)]
    assert any(place.endswith('common.nodl.yaml:3:27') for place in places), places


XML = '<interface version="1"><node name="n" executable="e" /></interface>'


@pytest.mark.parametrize(
    ('process', 'documents'),
    [
        ('interface: old.nodl.xml', {'old.nodl.xml': XML}),
        ('interface: old', {'old': f'\ufeff\n<?xml version="1.0"?>{XML}'}),
        ('nodes: {a: {interface: old}}', {'old': f'<!-- old -->{XML}'}),
        (
            'interface: new.yaml',
            {'old': XML, 'new.yaml': "nodl_version: 2\ninclude: [{ref: 'local://old'}]"},
        ),
    ],
)
def test_a_document_of_version_1_is_one_error(load, process, documents):
    _, (finding,) = load(process, **documents)
    assert finding.rule == 'bad-node-interface'
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
    _, findings = load('interface: bad.nodl.yaml', **{'bad.nodl.yaml': YAML.replace(old, new, 1)})
    assert {each.rule for each in findings} == {'bad-node-interface'}
    texts = [f'{each.message} {each.help}' for each in findings]
    assert any(said in text for text in texts), texts


@pytest.mark.parametrize(
    ('process', 'rule', 'said'),
    [
        ('interface: camra.nodl.yaml', 'bad-node-interface', "did you mean 'camera.nodl.yaml'?"),
        ('interface: package://nowhere/x.xml', 'uninstalled-package', 'nowhere'),
        (
            'interface: common.nodl.yaml, nodes: {a: {interface: nothing.xml}}',
            'bad-node-interface',
            'nothing.xml',
        ),
    ],
)
def test_a_document_that_is_not_there_is_an_error(load, process, rule, said):
    _, findings = load(process)
    assert [each.rule for each in findings] == [rule]
    assert said in f'{findings[0].message} {findings[0].help}'


LIBRARY = """\
driver:
  rate: {type: double, default_value: 10.0, validation: {"bounds<>": [1.0, 50.0]}}
  wheel:
    radius: {type: double, read_only: true, validation: {gt<>: [0.0]}}
    teeth: {type: int, validation: {gt: [15], lt_eq<>: [20]}}
  mode: {type: string_fixed_25, validation: {one_of<>: [[slow, fast]]}}
  __map_joints:
    gain: {type: double}
  elsewhere: {type: none}
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package with a document of each kind, built so that it leads to its source."""
    source, prefix = tmp_path / 'source', tmp_path / 'install'
    share, index = prefix / 'share' / 'maker', prefix / 'share/ament_index/resource_index'
    for folder in (source / 'src', share, index / 'packages', index / 'nodl'):
        folder.mkdir(parents=True)
    (source / 'package.xml').touch()
    (share / 'package.xml').symlink_to(source / 'package.xml')
    (index / 'packages' / 'maker').touch()
    (index / 'nodl' / 'maker__camera').write_text(YAML.replace('include', 'description2', 0))
    (index / 'nodl' / 'maker__broken').write_text('nodl_version: 2\nnothing: 1\n')
    (source / 'src' / 'driver_parameters.yaml').write_text(LIBRARY)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))


LIBRARY_FINDINGS = {
    'rate: 60.0': ('refused-parameter', 'above the maximum 50'),
    'rate: fast': ('refused-parameter', 'expected a double'),
    'wheel: {teeth: 15}': ('refused-parameter', 'below the minimum 16'),
    'mode: fats': ('refused-parameter', 'slow'),
    'ratr: 10.0': ('undeclared-parameter', "did you mean 'rate'?"),
    'joint1: {gain: 1.0}': None,
    'elsewhere: 3': None,
    'wheel: {teeth: 16, radius: 0.5}': None,
}
WAYS = {
    'named': "command: ['true'], name: front, interface: driver.yaml",
    'of the program': 'package: maker, executable: driver_node, name: front',
    'of the node': "command: ['true'], nodes: {front: {interface: driver.yaml}}",
    'of a component': None,
}


@pytest.mark.parametrize(
    ('way', 'in_file', 'given'),
    [
        *(('named', False, given) for given in LIBRARY_FINDINGS),
        *((way, True, 'rate: 60.0') for way in WAYS),
        ('of the program', False, 'rate: 60.0'),
        ('of a component', False, 'ratr: 10.0'),
    ],
)
def test_a_parameter_library_says_what_values_are_right(
    tmp_path, monkeypatch, installed, way, in_file, given
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'driver.yaml').write_text(LIBRARY)
    (tmp_path / 'values.yaml').write_text(f'front: {{ros__parameters: {{{given}}}}}\n')
    values = 'parameter_files: [values.yaml]' if in_file else f'parameters: {{{given}}}'
    plugin = f"front: {{package: maker, plugin: 'maker::Driver', {values}}}"
    text = f'processes: {{driver: {{{WAYS[way]}, {values}}}}}'
    if WAYS[way] is None:
        text = f'containers: {{box: {{components: {{{plugin}}}}}}}'
    path = tmp_path / 'robot.yaml'
    path.write_text(f'version: 1\nnodes: {{}}\n{text}\n')
    findings = [
        each
        for each in check_system(load_system(path), InterfaceCatalogue())
        if each.rule in {'refused-parameter', 'undeclared-parameter', 'bad-parameter'}
    ]
    if LIBRARY_FINDINGS[given] is None:
        assert not findings
    else:
        rule, said = LIBRARY_FINDINGS[given]
        (finding,) = findings
        assert finding.rule in {rule, 'bad-parameter'}
        assert said in f'{finding.message} {finding.help}'


def test_an_installed_document_is_read_and_a_broken_one_is_left(tmp_path, installed, load):
    for executable, has_ends in (('camera', True), ('broken', False), ('none', False)):
        path = tmp_path / 'robot.yaml'
        process = f'package: maker, executable: {executable}, name: front'
        path.write_text(f'version: 1\nnodes: {{}}\nprocesses: {{camera: {{{process}}}}}\n')
        (tmp_path / 'install/share/ament_index/resource_index/nodl/common.nodl.yaml').write_text(
            COMMON
        )
        system = load_system(path)
        assert not system.diagnostics
        found = ends(system.spec.processes['camera'])
        assert (('/front', 'services', '~/enable', 'std_srvs/srv/SetBool') in found) == has_ends
    process, findings = load('name: front, interface: "nodl://maker/camera"')
    assert not findings
    assert ('/front', 'services', '~/enable', 'std_srvs/srv/SetBool') in ends(process)


EXPORTED = """\
version: 1
nodes:
  arm/driver:
    description: Moves.
    parameters:
      rate: {default: 5, minimum: 1, maximum: 9, read_only: true}
      mode: {default: slow, choices: [slow, fast]}
      names: [a, b]
    publishers:
      state: {type: sensor_msgs/msg/JointState, qos: {profile: sensor_data, deadline: 0.5}}
    service_clients: {home: {type: std_srvs/srv/Trigger, external: true}}
"""


def test_what_is_exported_says_the_same_when_it_is_read(tmp_path, load):
    (tmp_path / 'arm.yaml').write_text(EXPORTED.replace('arm/driver', 'driver'))
    words = ['export', 'nodl', str(tmp_path / 'arm.yaml'), '-o', str(tmp_path / 'out')]
    assert run(words) == 0
    text = (tmp_path / 'out' / 'driver.nodl.yaml').read_text()
    process, findings = load('name: driver, interface: exported.yaml', **{'exported.yaml': text})
    assert not findings
    (node,) = process.nodes
    state = node.sections['publishers']['state']
    assert state.qos.policies['reliability'] == 'best_effort'
    assert state.qos.policies['deadline'] == 0.5
    assert node.sections['service_clients']['home'].type == 'std_srvs/srv/Trigger'
    own = load_system(tmp_path / 'arm.yaml').spec.nodes['driver'].parameters
    for name, parameter in node.parameters.items():
        for key in ('type', 'value', 'minimum', 'maximum', 'choices', 'read_only'):
            assert getattr(parameter, key) == getattr(own[name], key), (name, key)
