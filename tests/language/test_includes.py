"""Includes: other files as parts of this one."""

import textwrap

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.rules import Severity

ARM = """
version: 1
args: {side: {type: string}, joints: 2}
defaults: {namespace: arm, log_level: debug, qos: fast}
qos: {fast: {depth: 3}}
nodes:
  driver:
    publishers: {state: std_msgs/msg/String, other: {type: std_msgs/msg/String, qos: 4}}
    parameters: {side: "{{ side }}"}
  "joint_{{ j }}": {foreach: {j: "{{ range(joints) }}"}, namespace: /fixed}
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(**files):
        for name, text in files.items():
            (tmp_path / f'{name}.yaml').write_text(textwrap.dedent(text).lstrip())
        from pathlib import Path

        return Path('robot.yaml')

    return write


def robot(include, rest='nodes: {}'):
    return f'version: 1\ninclude:\n  part: {include}\n{rest}\n'


def full_names(system):
    return [f'{node.namespace}/{node.name}' for node in system.spec.nodes.values()]


def findings(system):
    return [(each.rule, str(each.span), each.message) for each in system.diagnostics]


def test_a_file_gets_its_arguments_and_keeps_its_defaults_and_profiles(write):
    path = write(
        arm=ARM,
        robot=robot('{file: arm.yaml, args: {side: left}}', 'nodes: {brain: {}}'),
    )
    system = load_system(path)
    assert not system.diagnostics
    nodes = system.spec.nodes
    assert full_names(system) == ['//brain', '/arm/driver', '/fixed/joint_0', '/fixed/joint_1']
    assert nodes['driver'].parameters['side'].value == 'left'
    assert (nodes['driver'].log_level, nodes['brain'].log_level) == ('debug', None)
    assert nodes['driver'].publishers['state'].qos.profile == 'fast'
    assert nodes['driver'].publishers['other'].qos.policies == {'depth': 4}


def test_nothing_leaks_into_an_included_file(write):
    text = 'defaults: {log_level: error, qos: 9, namespace: outer}\nqos: {slow: {depth: 1}}\n'
    path = write(
        part='version: 1\nnodes: {n: {publishers: {a: {type: std_msgs/msg/Empty}}}}',
        robot=robot('{file: part.yaml}', f'{text}nodes: {{m: {{}}}}'),
    )
    system = load_system(path)
    node = system.spec.nodes['n']
    assert (node.namespace, node.log_level) == ('/', None)
    assert node.publishers['a'].qos.policies == {}
    assert system.spec.nodes['m'].namespace == '/outer'


def test_a_file_included_twice_needs_two_namespaces(write):
    include = """
        version: 1
        include:
          left: {file: arm.yaml, namespace: left, args: {side: left, joints: 0}}
          right: {file: arm.yaml, namespace: /right, args: {side: right, joints: 0}}
        nodes: {}
    """
    system = load_system(write(arm=ARM, robot=include))
    assert not system.diagnostics
    assert full_names(system) == ['/left/arm/driver', '/right/arm/driver']


def test_the_same_full_name_twice_is_said_with_the_include(write):
    include = """
        version: 1
        include:
          left: {file: arm.yaml, args: {side: left, joints: 0}}
          right: {file: arm.yaml, args: {side: right, joints: 0}}
        nodes: {}
    """
    (finding,) = load_system(write(arm=ARM, robot=include)).diagnostics
    assert (finding.rule, str(finding.span)) == ('duplicate-node', 'arm.yaml:6:3')
    assert [str(each.span) for each in finding.related] == ['robot.yaml:4:17']


def test_profiles_of_one_name_stay_apart(write):
    path = write(
        arm=ARM,
        robot=robot(
            '{file: arm.yaml, args: {side: l, joints: 0}}',
            'qos: {fast: {depth: 8}}\nnodes: {n: {publishers: {a: {type: a/msg/B, qos: fast}}}}',
        ),
    )
    spec = load_system(path).spec
    own = spec.nodes['n'].publishers['a'].qos.profile
    other = spec.nodes['driver'].publishers['state'].qos.profile
    assert spec.qos[own].policies == {'depth': 8}
    assert spec.qos[other].policies == {'depth': 3}


def test_rules_of_the_include_come_first(write):
    path = write(
        part='version: 1\nnodes: {n: {remap: {a: inner, b: inner}}}',
        robot=robot('{file: part.yaml, remap: {b: outer, c: outer}}'),
    )
    rules = load_system(path).spec.nodes['n'].remap
    assert rules == (('b', 'outer'), ('c', 'outer'), ('a', 'inner'))


def test_includes_are_repeated_and_left_out(write):
    include = """
        version: 1
        args: {count: 2}
        include:
          "robot_{{ i }}":
            foreach: {i: "{{ range(count) }}"}
            file: part.yaml
            namespace: "robot_{{ i }}"
          real: {file: part.yaml, when: false}
        nodes: {}
    """
    system = load_system(write(part='version: 1\nnodes: {n: {}}', robot=include))
    assert not system.diagnostics
    assert full_names(system) == ['/robot_0/n', '/robot_1/n']


def test_a_finding_in_the_deepest_file_comes_with_the_chain_of_includes(write):
    path = write(
        leaf='version: 1\nnodes: {leaf: {log_levl: debug}}',
        mid=robot('{file: leaf.yaml}'),
        robot=robot('{file: mid.yaml}'),
    )
    (finding,) = load_system(path).diagnostics
    assert (finding.rule, str(finding.span)) == ('unknown-key', 'leaf.yaml:2:16')
    assert [str(each.span) for each in finding.related] == ['mid.yaml:3:16', 'robot.yaml:3:16']


@pytest.mark.parametrize(
    ('include', 'expected'),
    [
        (
            '{file: amr.yaml, args: {side: l}}',
            ('missing-include', 'robot.yaml:3:16', "there is no file 'amr.yaml'"),
        ),
        (
            '{file: arm.yaml, args: {side: l, jonts: 3}}',
            ('unknown-argument', 'robot.yaml:3:42', "'arm.yaml' takes no argument 'jonts'"),
        ),
        (
            '{file: arm.yaml}',
            ('missing-argument', 'robot.yaml:3:16', "'arm.yaml' needs the argument 'side'"),
        ),
        (
            '{file: arm.yaml, args: {side: l, joints: many}}',
            ('argument-type', 'robot.yaml:3:50', "'joints': expected an integer, got 'many'"),
        ),
        (
            '{file: robot.yaml}',
            ('include-cycle', 'robot.yaml:3:16', "'robot.yaml' includes itself"),
        ),
    ],
)
def test_what_is_wrong_with_an_include_is_said_at_its_place(write, include, expected):
    (finding,) = findings(load_system(write(arm=ARM, robot=robot(include))))
    assert finding == expected


# Includes in includes

MIDDLE = """
version: 1
include:
  left: {file: leaf.yaml, namespace: left}
  right: {file: leaf.yaml, namespace: right}
nodes: {}
"""


def test_a_relative_namespace_stays_relative_through_all_includes(write):
    path = write(
        leaf='version: 1\nnodes: {t: {}}\n',
        middle=MIDDLE,
        robot='version: 1\ninclude: {a: {file: middle.yaml, namespace: a}, b: {file: middle.yaml, '
        'namespace: b}}\nnodes: {}\n',
    )
    system = load_system(path)
    assert not system.diagnostics
    names = [node.full_name for node in system.spec.nodes.values()]
    assert names == ['/a/left/t', '/a/right/t', '/b/left/t', '/b/right/t']


@pytest.mark.parametrize('who', ['robot', 'leaf'])
def test_the_profiles_of_one_file_are_not_those_of_another(write, who):
    user = 'nodes: {n: {publishers: {c: {type: std_msgs/msg/String, qos: fast}}}}'
    owner = 'qos: {fast: {depth: 1}}\nnodes: {}'
    rest = {'robot': owner, 'leaf': owner} | {who: user}
    path = write(
        leaf=f'version: 1\n{rest["leaf"]}', robot=robot('{file: leaf.yaml}', rest['robot'])
    )
    (finding,) = load_system(path).diagnostics
    assert (finding.rule, finding.message) == (
        'unknown-qos-profile',
        "there is no QoS profile 'fast'",
    )
    assert finding.span.source.name == f'{who}.yaml'
    assert len(finding.related) == (who == 'leaf')


def test_variables_of_the_environment_are_those_of_the_file_that_is_started(write):
    path = write(
        leaf='version: 1\nenvironment: {A: 1, B: 2}\nnodes: {}\n',
        middle=robot('{file: leaf.yaml}', 'environment: {B: 3}\nnodes: {}'),
        off='version: 1\nenvironment: {C: 1}\nnodes: {}\n',
        robot='version: 1\nenvironment: {A: 4}\ninclude:\n  middle: {file: middle.yaml}\n'
        '  off: {file: off.yaml, when: false}\n',
    )
    system = load_system(path)
    assert system.spec.environment == {'A': '4'}
    found = {(each.rule, each.severity, str(each.span)) for each in system.diagnostics}
    assert found == {
        ('ignored-environment', Severity.WARNING, 'leaf.yaml:2:21'),
        ('ignored-environment', Severity.WARNING, 'middle.yaml:4:15'),
    }


# Includes that are left out

SWITCH = """
version: 1
args: {real: false, ip: ''}
include:
  sim: {file: sim.yaml, when: "{{ not real }}"}
  real: {file: real.yaml, when: "{{ real }}", args: {ip: "{{ ip }}"}}
"""
SIM = 'version: 1\nqos: {fast: {depth: 1}}\nnodes: {camera: {log_level: info}}\n'


def switch(real, sim=SIM, **files):
    return {'sim': sim, 'real': f'version: 1\n{real}', 'robot': SWITCH, **files}


@pytest.mark.parametrize(
    ('real', 'words', 'expected'),
    [
        (
            'args: {ip: {type: string}}\nnodes: {camera: {log_levl: info}}',
            [],
            [('unknown-key', 'real.yaml:3:18', ['robot.yaml:5:16'])],
        ),
        (
            'args: {op: x}\nnodes: {}',
            [],
            [('unknown-argument', 'robot.yaml:5:54', [])],
        ),
        (
            'args: {ip: {type: string}, x: {type: string}}\nnodes: {}',
            [],
            [('missing-argument', 'robot.yaml:5:16', [])],
        ),
    ],
)
def test_what_an_include_that_is_left_out_brings_is_checked(write, real, words, expected):
    system = load_system(write(**switch(real)), words)
    assert [
        (each.rule, str(each.span), [str(place.span) for place in each.related])
        for each in system.diagnostics
    ] == expected
    assert full_names(system) == ['//camera']


@pytest.mark.ros
def test_all_rules_hold_for_what_is_left_out(write):
    real = """args: {ip: {type: string}}
qos: {fast: {depth: 9}}
interfaces: {no_such_msgs: no/such/folder}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/Strng, qos: fast}}
processes:
  camera: {command: ['true'], name: 1x}
"""
    sim = SIM + "processes: {camera: {command: ['true']}}\n"
    system = load_system(write(**switch(real, sim)))
    findings = check_system(system, InterfaceCatalogue())
    assert {(each.rule, each.file, each.span.line) for each in findings} >= {
        ('unknown-interfaces', 'real.yaml', 4),
        ('unknown-type', 'real.yaml', 7),
        ('bad-name', 'real.yaml', 9),
    }
    assert system.data['qos'] == {'fast': {'depth': 1}}
    assert system.data['interfaces'] == {}
    assert [*system.data['nodes']] == [*system.data['processes']] == ['camera']


@pytest.mark.parametrize('namespace', ['left arm', '9lives', '/a//b', 'a-b', '/left/'])
def test_a_namespace_that_ros_refuses_is_said_at_the_include_once(write, namespace):
    path = write(
        robot=robot(f'{{file: arm.yaml, namespace: "{namespace}", args: {{side: left}}}}'), arm=ARM
    )
    ((rule, place, message),) = findings(load_system(path))
    assert (rule, place.rpartition(':')[0]) == ('bad-name', 'robot.yaml:3')
    assert message.startswith(f"'{namespace}': ")
    findings_of_nodes = check_system(load_system(path), InterfaceCatalogue([]))
    assert [each.rule for each in findings_of_nodes if each.rule == 'bad-name'] == ['bad-name']
