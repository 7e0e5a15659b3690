"""What external processes are said to have is checked like what nodes have."""

from textwrap import indent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system, load_system_text

# A node that hears and calls a camera, and steers a base.
NODES = """\
nodes:
  detector:
    subscriptions:
      image: {type: sensor_msgs/msg/Image, behaviour: 'behaviours.logging:log', qos: sensor_data}
    service_clients: {set_camera_info: sensor_msgs/srv/SetCameraInfo}
    action_clients: {fibonacci: test_msgs/action/Fibonacci}
    publishers: {cmd_vel: geometry_msgs/msg/Twist}
    on_start: behaviours.logging:start
"""
CAMERA = """\
camera:
  command: ['true']
  publishers:
    image: {type: sensor_msgs/msg/Image, qos: {reliability: best_effort}}
    debug: std_msgs/msg/String
  services: {set_camera_info: sensor_msgs/srv/SetCameraInfo}
  actions: {fibonacci: test_msgs/action/Fibonacci}
"""
BASE = """\
base:
  command: ['true']
  subscriptions: {cmd_vel: geometry_msgs/msg/Twist}
"""
SILENT = {'unused-publisher', 'unused-service-client', 'unused-action-client', 'unread-module'}


def check(processes, nodes=NODES):
    text = f'version: 1\n{nodes}processes:\n{indent(processes, "  ")}'
    findings = check_system(load_system_text(text), InterfaceCatalogue())
    return [each for each in findings if each.rule not in (*SILENT, 'unknown-behaviour')]


def test_a_system_whose_processes_have_what_its_nodes_need_has_no_findings():
    assert not check(CAMERA + BASE)


@pytest.mark.parametrize(
    ('old', 'new', 'rule', 'said'),
    [
        ('msg/Image,', 'msg/CompressedImage,', 'conflicting-types', 'image'),
        ('sensor_msgs/srv/SetCameraInfo', 'std_srvs/srv/Trigger', 'conflicting-types', 'service'),
        ('{reliability: best_effort}', '{liveliness: manual}', 'bad-value', 'manual_by_topic'),
        ('    image:', '    imgae:', 'no-publisher', '/image'),
        ('{set_camera_info:', '{set_info:', 'no-server', '/set_camera_info'),
        ('  publishers:', '  namespace: left\n  publishers:', 'no-publisher', '/image'),
        ('  publishers:', '  remap: {image: picture}\n  publishers:', 'no-publisher', '/image'),
        ('  publishers:', '  publisher:', 'unknown-key', 'publisher'),
        ('{cmd_vel:', '{cmd_vle:', 'no-subscription', '/cmd_vel'),
        ('qos: {reliability: best_effort}', 'qos: sensor_dat', 'unknown-qos-profile', 'sensor'),
    ],
)
def test_a_mistake_in_a_declaration_is_found(old, new, rule, said):
    processes = CAMERA + BASE
    assert old in processes
    found = check(processes.replace(old, new, 1))
    assert any(each.rule == rule and said in each.message for each in found), found


def test_qos_that_never_matches_is_reported_at_the_node_that_can_follow():
    nodes = NODES.replace(', qos: sensor_data', '')
    (finding,) = check(CAMERA + BASE, nodes)
    assert finding.rule == 'incompatible-qos'
    assert "publisher 'image' of process 'camera'" in finding.message
    assert 'image:' in finding.span.source.line(finding.span.line)
    assert finding.span.line < nodes.count('\n')


def test_names_are_those_of_the_process():
    camera = CAMERA.replace(
        '  publishers:',
        '  name: front\n  namespace: /left\n  remap: {~/image: /image}\n  publishers:',
    )
    camera = camera.replace('    image: {', '    image: {topic: ~/image, ')
    camera = camera.replace('{set_camera_info:', '{/set_camera_info:')
    camera = camera.replace('{fibonacci:', '{/fibonacci:')
    assert not check(camera + BASE)


SEVERAL = """\
robot:
  command: ['true']
  namespace: /
  nodes:
    camera:
      publishers: {/image: {type: sensor_msgs/msg/Image, qos: sensor_data}}
      services: {/set_camera_info: sensor_msgs/srv/SetCameraInfo}
    arm/counter:
      actions: {/fibonacci: test_msgs/action/Fibonacci}
    base: %s
"""


def test_each_node_of_a_process_has_its_own_ends():
    assert not check(SEVERAL % '{subscriptions: {cmd_vel: geometry_msgs/msg/Twist}}')
    (finding,) = check(SEVERAL % '{}')
    assert (finding.rule, finding.span.text) == ('no-subscription', 'cmd_vel')


def test_a_process_without_declarations_may_have_anything():
    assert not check("other: {command: ['true']}\n", NODES)
    assert not check("other: {command: ['true'], nodes: [camera, base]}\n", NODES)


def test_what_a_program_publishes_need_not_be_heard_but_what_it_hears_is_missed():
    extra = '  publishers: {more: std_msgs/msg/String}\n'
    assert not check(CAMERA + BASE + extra)
    (finding,) = check(CAMERA + BASE.replace('{cmd_vel', '{odom: std_msgs/msg/String, cmd_vel'))
    assert (finding.rule, finding.span.text) == ('no-publisher', 'odom')
    elsewhere = '{odom: {type: std_msgs/msg/String, external: true}, cmd_vel'
    assert not check(CAMERA + BASE.replace('{cmd_vel', elsewhere))


CONTAINER = """\
containers:
  robot:
    command: ['true']
    components:
      camera:
        package: image_tools
        plugin: image_tools::Cam2Image
        remap: {picture: image}
        parameters: {rate: {type: double, default: 2}, size: {type: integer_array}}
        publishers: {picture: {type: sensor_msgs/msg/Image, qos: sensor_data}}
        services: {set_camera_info: sensor_msgs/srv/SetCameraInfo}
        actions: {fibonacci: test_msgs/action/Fibonacci}
      base: {package: base, plugin: 'base::Base', %s}
"""


def test_components_have_ends_as_processes_do():
    def rules(container):
        text = f'version: 1\n{NODES}{container}'
        system = load_system_text(text)
        assert system.spec.processes['robot'].components['camera'].parameters == {'rate': 2.0}
        found = check_system(system, InterfaceCatalogue())
        said = ('no-', 'conflicting', 'likely')
        return [each.rule for each in found if each.rule.startswith(said)]

    whole = CONTAINER % 'subscriptions: {cmd_vel: geometry_msgs/msg/Twist}'
    assert not rules(whole)
    assert rules(whole.replace('{cmd_vel:', '{vel:')) == ['no-subscription', 'no-publisher']
    assert rules(whole.replace('{picture: image}', '{pictures: image}')) == [
        *('no-publisher', 'likely-misspelling'),
    ]
    assert rules(whole.replace('msg/Image', 'msg/Imu')) == ['conflicting-types']
    assert not rules(CONTAINER % 'namespace: x')
    outside = whole.replace("command: ['true']", 'external: true').replace('{cmd_vel:', '{vel:')
    assert not rules(outside)


@pytest.mark.parametrize(
    ('rule', 'meant'),
    [
        ('image: picture', None),
        ('~/image: picture', "did you mean '/image'?"),
        ('imgae: picture', "did you mean 'image'?"),
        ('/tf: tf', None),
        ('rosservice://set_camera_info: info', None),
    ],
)
def test_a_rule_of_a_process_for_what_it_does_not_have_is_reported(rule, meant):
    named = CAMERA.replace('  publishers:', f'  name: camera\n  remap: {{{rule}}}\n  publishers:')
    found = [each for each in check(named + BASE) if each.rule == 'likely-misspelling']
    assert [each.help for each in found] == ([meant] if meant else [])
    nameless = named.replace('  name: camera\n', '')
    found = [each for each in check(nameless + BASE) if each.rule == 'likely-misspelling']
    assert len(found) == (meant is not None and '~' not in rule)


PARAMETERS = """\
robot:
  command: ['true']
  name: robot
  parameters: {%s}
  nodes:
    robot:
      parameters:
        rate: {type: double, maximum: 5}
        gains.p: 1.0
        mode: {default: fast, choices: [fast, slow]}
"""


@pytest.mark.parametrize(
    ('given', 'finding'),
    [
        ('rate: 1.0, gains: {p: 2.0}, mode: slow, use_sim_time: true', None),
        ('rate: 1', ('refused-parameter', 'write 1.0')),
        ('mode: slwo', ('refused-parameter', "did you mean 'slow'?")),
        ('gains: {p: x}', ('refused-parameter', None)),
        ('rat: 1.0', ('undeclared-parameter', "did you mean 'rate'?")),
        ('rate: {type: integer, default: a}', ('bad-parameter', None)),
    ],
)
def test_values_are_compared_with_the_parameters_that_are_declared(given, finding):
    found = check(PARAMETERS % given, 'nodes: {}\n')
    assert [(each.rule, each.help) for each in found] == ([finding] if finding else [])


def test_an_included_file_has_its_own_namespace_and_profiles(tmp_path):
    (tmp_path / 'arm.yaml').write_text(
        """\
version: 1
qos: {fast: {reliability: best_effort}}
processes:
  driver:
    command: ['true']
    name: driver
    publishers: {joints: {type: std_msgs/msg/String, qos: fast}}
"""
    )
    main = tmp_path / 'robot.yaml'
    main.write_text(
        """\
version: 1
qos: {fast: {reliability: reliable, depth: 1}}
include: {left: {file: arm.yaml, namespace: left}}
nodes:
  reader:
    subscriptions:
      joints: {type: std_msgs/msg/String, topic: left/joints, qos: %s, publish: copy}
    publishers: {copy: {type: std_msgs/msg/String, external: true}}
"""
    )
    text = main.read_text()
    for profile, rules in (('sensor_data', []), ('fast', ['incompatible-qos'])):
        main.write_text(text % profile)
        findings = check_system(load_system(main), InterfaceCatalogue())
        assert [each.rule for each in findings] == rules
