"""Values that follow parameters: from defaults, layers, parameter files and the command line."""

from textwrap import dedent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

SYSTEM = """
version: 1
include:
  left: {file: robot.yaml, namespace: left}
  right: {file: robot.yaml, namespace: right}
"""
ROBOT = """
version: 1
defaults: {namespace: base}
nodes:
  lidar:
    parameter_files: [files/lidar.yaml]
    parameters:
      rate: {default: 10, minimum: 1}
      period_ms: {default: 500.0, minimum: 1.0}
      prefix: p
      depth: 3
      topics: [a]
    publishers:
      "{{ t }}":
        foreach: {t: {parameter: topics}}
        type: std_msgs/msg/String
        topic: {parameter: prefix, format: "{}/{{ t }}"}
        qos: {profile: sensor_data, depth: {parameter: depth}}
        external: true
    timers:
      tick: {rate: {parameter: rate}, publish: a, message: x}
      tock: {period: {parameter: period_ms, scale: 0.001}, publish: a, message: x}
"""
FILE = """
/left/base/lidar:
  ros__parameters: {topics: [a, c], depth: 9}
/**:
  ros__parameters: {prefix: "q"}
"""
LAYER = """
nodes:
  lidar: {parameters: {rate: {default: 40, minimum: 1}}}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'files').mkdir()
    for name, text in {
        'system.yaml': SYSTEM,
        'robot.yaml': ROBOT,
        'files/lidar.yaml': FILE,
        'layer.yaml': LAYER,
    }.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def describe(system):
    return {
        node.full_name: (
            {each.topic: each.qos.policies['depth'] for each in node.publishers.values()},
            {each.name: each.period_sec for each in node.timers.values()},
        )
        for node in system.spec.nodes.values()
    }


def test_each_node_has_the_values_that_its_parameters_start_with(folder):
    system = load_system(folder / 'system.yaml')
    timers = {'tick': 0.1, 'tock': 0.5}
    assert describe(system) == {
        '/left/base/lidar': ({'q/a': 9, 'q/c': 9}, timers),
        '/right/base/lidar': ({'q/a': 3}, timers),
    }
    assert not system.diagnostics


def test_layers_and_the_command_line_count(folder):
    arguments = ('-p', 'lidar:=1', '-p', 'prefix:=z', '-p', 'topics:=[a, e]', '-p', 'depth:=1.5')
    system = load_system(
        folder / 'robot.yaml', layers=[folder / 'layer.yaml'], ros_arguments=arguments
    )
    # A value of another type is refused when the node starts.
    assert describe(system) == {
        '/base/lidar': ({'z/a': 3, 'z/e': 3}, {'tick': 0.025, 'tock': 0.5})
    }
    node = system.spec.nodes['lidar']
    read_only = {name for name, each in node.parameters.items() if each.read_only}
    assert read_only == {'prefix', 'depth', 'topics'}
    assert set(node.followed) == set(node.parameters)


@pytest.mark.parametrize(
    ('parameters', 'timer', 'expected'),
    [
        ('{r: {default: 1.0, minimum: 0.5}}', 'rate: {parameter: r}', None),
        ('{r: 1.0}', 'rate: {parameter: r}', "follow parameter 'r': it may be 0"),
        ('{r: {default: 1, choices: [0, 1]}}', 'period: {parameter: r}', 'it may be 0'),
        ('{r: fast}', 'rate: {parameter: r}', "it is of type 'string'"),
        ('{r: {type: double}}', 'rate: {parameter: r}', 'it has no value'),
        ('{s: 1.0}', 'rate: {parameter: r}', "node 'n' declares no parameter 'r'"),
        ('{r: 1.0}', 'rate: {parameter: [r]}', 'expected a string'),
        ('{r: 1}', 'foreach: {i: {parameter: r}}, rate: 1', "'r' of node 'n' is no list"),
        (
            '{r: {command: [ls], type: string_array}}',
            'foreach: {i: {parameter: r}}, rate: 1',
            "the list of parameter 'r' must stand in the file",
        ),
    ],
)
def test_what_cannot_be_followed_is_a_finding(tmp_path, parameters, timer, expected):
    path = tmp_path / 'system.yaml'
    path.write_text(
        dedent(f"""
        version: 1
        nodes:
          n:
            parameters: {parameters}
            publishers: {{p: {{type: std_msgs/msg/String, external: true}}}}
            timers: {{t: {{{timer}, publish: p, message: x}}}}
        """)
    )
    findings = [
        each
        for each in check_system(load_system(path), InterfaceCatalogue())
        if each.severity.value == 'error'
    ]
    if expected is None:
        assert not findings
    else:
        assert expected in ' '.join(each.message for each in findings)
        assert all(each.span for each in findings)
