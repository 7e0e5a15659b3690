"""Parameter files against the nodes that use them."""

from textwrap import dedent, indent

import pytest

from composer.checks.checker import check_system
from composer.checks.process_parameters import LEAVE_OUT, NO_TYPE
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system


@pytest.fixture
def check(tmp_path, monkeypatch):
    """Return a function that checks a system with parameter files.

    It returns `place rule: message` of each finding, and its help after an arrow.
    """
    monkeypatch.chdir(tmp_path)

    def run(nodes, *, more='', before='', **files):
        for name, text in files.items():
            (tmp_path / f'{name}.yaml').write_text(dedent(text).lstrip('\n'))
        path = tmp_path / 'system.yaml'
        path.write_text(f'version: 1\n{before}nodes:\n{indent(dedent(nodes), "  ")}{dedent(more)}')
        found = check_system(load_system(path), InterfaceCatalogue())
        return [
            f'{finding.span or finding.file} {finding.rule}: {finding.message}'
            + (f' → {finding.help}' if finding.help else '')
            for finding in found
        ]

    def relative(*arguments, **options):
        return [line.replace(f'{tmp_path}/', '') for line in run(*arguments, **options)]

    return relative


ARM = """
  arm:
    namespace: robot
    parameter_files: [p.yaml]
    parameters:
      speed: {default: 1.0, maximum: 2.0}
      mode: {default: slow, choices: [slow, fast]}
      gains: [1.0]
      names: {type: string_array}
      octets: {default: [1], type: byte_array}
      count: {default: 1, minimum: 0, maximum: 10}
"""


PROCESS = """
processes:
  nav:
    command: [sleep, '1']
    namespace: robot
    parameter_files: [p.yaml]
"""
NAV = """
    controller_server:
      ros__parameters: {rate: 1.0}
    /robot/local_costmap/local_costmap:
      ros__parameters: {width: 3}
    /robot/controler_server:
      ros__parameters: {rate: 1.0}
    """


def test_a_section_is_held_against_the_nodes_that_a_process_says_it_has(check):
    # Which nodes the program makes, nobody knows.
    assert check('{}\n', more=PROCESS, p=NAV) == []
    nodes = '    nodes: [controller_server, local_costmap/local_costmap]\n'

    assert check('{}\n', more=PROCESS + nodes, p=NAV) == [
        "p.yaml:1:1 unmatched-node-name: 'controller_server' matches no node that uses this "
        "file, so ROS ignores it → did you mean '/robot/controller_server'?",
        "p.yaml:5:1 unmatched-node-name: '/robot/controler_server' matches no node that uses "
        "this file, so ROS ignores it → did you mean '/robot/controller_server'?",
    ]
    declared = '    nodes: {controller_server: {parameters: {rate: 2}}, controler_server: }\n'
    assert check(
        '{}\n', more=PROCESS + declared, p=NAV.replace('controller_s', '/robot/controller_s')
    ) == [
        "p.yaml:2:27 refused-parameter: parameter 'rate' of node '/robot/controller_server': "
        'expected an integer, and ROS takes this for a double',
        "p.yaml:3:1 unmatched-node-name: '/robot/local_costmap/local_costmap' matches no node "
        'that uses this file, so ROS ignores it → it is used by: /robot/controler_server, /robot/controller_server',
    ]


def test_expressions_and_the_root_of_a_file_are_those_of_who_names_it(check):
    nodes = """
      "{{ side }}_arm":
        foreach: {side: [left, right]}
        parameters: {frame: base, speed: {default: 1.0, maximum: 2.0}, mode: {type: integer}}
        parameter_files: [{file: p.yaml, expressions: true, root: "{{ root }}"}]
        namespace: robot
    """
    text = """
    "{{ side }}_arm":
      ros__parameters: {frame: "{{ side }}_{{ suffix }}", speed: "{{ speed }}", mode: "{{ mode }}"}
    """
    before = 'args: {speed: 1.5, mode: {type: string}, root: robot}\nvars: {suffix: base}\n'
    # What `mode` will be is not known.
    assert check(nodes, p=text, before=before) == []
    assert check(nodes, p=text, before=before.replace('speed: 1.5', 'speed: 3.5')) == [
        "p.yaml:2:62 refused-parameter: parameter 'speed' of node '/robot/left_arm': "
        '3.5 is above the maximum 2.0',
        "p.yaml:2:62 refused-parameter: parameter 'speed' of node '/robot/right_arm': "
        '3.5 is above the maximum 2.0',
    ]
    found = check(nodes, p=text, before=before.replace('root: robot', 'root: robt'))
    assert [line.partition(':')[0] for line in found] == ['p.yaml'] * 2
    assert "'/robt/left_arm' matches no node" in found[0]
    assert check(nodes, p=text, before=before.replace('root: robot', 'root: a b')) != []
    plain = check(nodes.replace('expressions: true, ', ''), p=text, before=before)
    assert {line.split()[1] for line in plain} >= {'unevaluated-expression:'}


def test_a_file_that_suits_is_left_alone(check):
    text = """
        /**:
          ros__parameters: {use_sim_time: true, speed: 0.5}
        /robot/*:
          ros__parameters: {mode: fast, gains: [1.0, 2.0], names: [], count: 0x5}
        """
    assert check(ARM, p=text) == []


def test_what_matches_no_node_is_a_warning_at_its_name(check):
    text = '/robot/amr: {ros__parameters: {speed: 1.0}}\n/*: {ros__parameters: {speed: 1.0}}\n'
    assert check(ARM, p=text) == [
        "p.yaml:1:1 unmatched-node-name: '/robot/amr' matches no node that uses this file, "
        "so ROS ignores it → did you mean '/robot/arm'?",
        "p.yaml:2:1 unmatched-node-name: '/*' matches no node that uses this file, "
        'so ROS ignores it → it is used by: /robot/arm',
    ]


def test_what_no_node_declares_is_a_warning_at_its_key(check):
    text = '/**:\n  ros__parameters:\n    speeed: 1.0\n    sub: {deep: 1}\n'
    assert check('  arm: {parameter_files: [p.yaml]}\n', p=text)[0] == (
        "p.yaml:3:5 undeclared-parameter: node '/arm' declares no parameter 'speeed', "
        "and ROS ignores it → declare it under 'parameters:' of the node"
    )
    assert check(ARM, p=text)[0].endswith("→ did you mean 'speed'?")
    assert check(ARM, p=text)[1].startswith('p.yaml:4:11 undeclared-parameter: ')


@pytest.mark.parametrize(
    ('written', 'said'),
    {
        'speed: 1': 'expected a double, and ROS takes this for an integer → write 1.0',
        'speed: 1e400': 'expected a double, and ROS takes this for a string',
        'speed: 2.5': '2.5 is above the maximum 2.0',
        'mode: quick': "'quick' is not one of its choices: slow, fast",
        'mode: on': "expected a string, and ROS takes this for a bool → put it in quotes: 'on'",
        'gains: [1, 2]': (
            'expected a double_array, and ROS takes this for an integer_array → write [1.0, 2.0]'
        ),
        'octets: [1]': "parameter files have no byte type → give them under 'parameters:' of the node",
        'count: 11': '11 is above the maximum 10',
        'count: 9223372036854775808': 'expected an integer, and ROS takes this for a double',
        'count: []': 'expected an integer, and ROS takes this for an empty list',
        'use_sim_time: 1': 'expected a bool, and ROS takes this for an integer',
    }.items(),
)
def test_a_value_that_its_declaration_refuses_is_an_error_at_the_value(check, written, said):
    name, value = written.split(': ')
    assert check(ARM, p=f'/**:\n  ros__parameters:\n    {written}\n') == [
        f"p.yaml:3:{len(name) + 7} refused-parameter: parameter '{name}' of node '/robot/arm': "
        f'{said}'
    ]
    assert value


@pytest.mark.parametrize(
    ('name', 'help_text'),
    [
        ('sped', "did you mean 'speed'?"),
        ('use_sim_tme', "did you mean 'use_sim_time'?"),
        ('horizon', 'declared are: count, gains, mode, names, octets, speed'),
    ],
)
def test_an_undeclared_parameter_comes_with_the_nearest(check, name, help_text):
    (line,) = check(ARM, p=f'/**: {{ros__parameters: {{{name}: true}}}}')
    assert line.endswith(f'and ROS ignores it → {help_text}')


def test_a_file_that_several_nodes_use_is_spoken_of_once(check):
    nodes = """
      "arm_{{ i }}":
        foreach: {i: "{{ range(3) }}"}
        parameter_files: [p.yaml]
        parameters: {speed: 1.0}
    """
    text = """
        /**:
          ros__parameters: {speed: 1, sped: 1.0}
        arm_1: {ros__parameters: {speed: 1.0}}
        arm_3: {ros__parameters: {speed: 1.0}}
        arm_2: {ros_parameters: {}}
        """
    assert [line.split(': ')[0] for line in check(nodes, p=text)] == [
        'p.yaml:2:28 refused-parameter',
        'p.yaml:2:31 undeclared-parameter',
        'p.yaml:4:1 unmatched-node-name',
        'p.yaml:5:9 bad-parameter-file',
    ]


def test_a_value_that_never_counts_is_a_warning(check):
    def said(text):
        return check(ARM, p=text)

    head = '/robot/arm:\n  ros__parameters:\n    mode: fast\n'
    assert said(head + '    mode: slow\n') == [
        "p.yaml:3:5 overridden-parameter: 'mode' never has this value: p.yaml:4 overrides it "
        '→ remove one of them'
    ]
    assert said(head + '/**: {ros__parameters: {mode: slow}}\n') == [
        "p.yaml:3:5 overridden-parameter: 'mode' never has this value: p.yaml:4 overrides it "
        "→ the last name that matches a node wins: write '/**' above"
    ]
    assert said('/**: {ros__parameters: {mode: slow}}\n' + head) == []


def test_a_missing_file_is_an_error_where_it_is_named(check):
    (line,) = check(ARM)
    assert line == (
        'system.yaml:6:23 unreadable-file: p.yaml: cannot read the file: No such file or directory '
        '→ there are: system.yaml'
    )


@pytest.mark.ros
def test_an_unknown_package_is_an_error_where_it_is_named(check):
    nodes = ARM.replace('p.yaml', 'package://std_msg/p.yaml')
    assert check(nodes) == [
        "system.yaml:6:23 uninstalled-package: no package 'std_msg' is installed "
        "→ did you mean 'std_msgs'?"
    ]


def test_a_file_of_a_program_is_read_and_nothing_is_known_of_its_nodes(check):
    more = """
        processes:
          driver: {command: [sleep], parameter_files: [p.yaml]}
        """
    text = '/some/node: {ros__parameters: {anything: 1, other: }}'
    nodes = '  arm: {parameter_files: [p.yaml]}\n'
    assert [line.split(': ')[0] for line in check(nodes, more=more, p=text)] == [
        'p.yaml:1:52 bad-parameter-file'
    ]


@pytest.mark.parametrize(
    ('keys', 'values', 'pattern', 'is_lost'),
    [
        ('name: lidar, ', 'port: a', 'lidar', True),
        ('', 'port: a', '/**', True),
        ('nodes: [lidar], ', 'port: a', 'lidar', True),
        ('nodes: [lidar, other], ', 'port: a', 'lidar', False),
        ('name: lidar, ', 'port: b', 'lidar', False),
        # Of one name of nodes, integers come before texts.
        ('name: lidar, ', 'port: 1', '/*', True),
    ],
)
def test_a_parameter_of_a_program_that_its_file_overrides_is_a_warning(
    check, keys, values, pattern, is_lost
):
    more = f"""
        processes:
          driver: {{command: [sleep], {keys}parameters: {{{values}}}, parameter_files: [p.yaml]}}
        """
    found = check('  arm: {}\n', more=more, p=f'{pattern}: {{ros__parameters: {{port: b}}}}')
    place = f'system.yaml:6:{43 + len(keys)}'
    assert (
        found
        == [
            f"{place} overridden-parameter: 'port' never has this value: p.yaml:1 overrides it "
            "→ files override 'parameters': change it there, or remove it here"
        ]
        * is_lost
    )


@pytest.mark.parametrize(
    ('pattern', 'is_error'),
    [('/**', True), ('/arm', False)],
)
def test_an_empty_list_is_for_nodes_of_the_system_alone(check, pattern, is_error):
    more = """
        processes:
          driver: {command: [sleep], parameter_files: [p.yaml]}
        """
    nodes = '  arm: {parameter_files: [p.yaml], parameters: {a: {type: string_array}}}\n'
    text = f'/arm: {{ros__parameters: {{a: [b]}}}}\n{pattern}: {{ros__parameters: {{a: []}}}}\n'
    found = [line for line in check(nodes, more=more, p=text) if 'unmatched' not in line]
    told = (
        f"p.yaml:2:{len(pattern) + 25} refused-parameter: parameter 'a': {NO_TYPE} → {LEAVE_OUT}"
    )
    assert found == [told] * is_error


def test_the_name_of_a_programs_node_is_matched(check):
    more = """
        processes:
          driver: {command: [sleep], name: lidar, namespace: /robot, parameter_files: [p.yaml]}
        """
    text = '/robot/lidar: {ros__parameters: {a: 1}}\n/robot/lidr: {ros__parameters: {a: 1}}\n'
    (line,) = check('  arm: {}\n', more=more, p=text)
    assert line.startswith('p.yaml:2:1 unmatched-node-name')
    assert line.endswith("→ did you mean '/robot/lidar'?")


def test_a_comment_in_the_parameter_file_silences_a_warning(check):
    text = '/**:\n  ros__parameters:\n    sped: 1.0  # composer: ignore[undeclared-parameter]\n'
    assert check(ARM, p=text) == []
