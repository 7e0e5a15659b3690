"""Names that are all but those of something in the system."""

import subprocess
import sys
from textwrap import dedent

import pytest

from composer.ament import remaps_actions
from composer.checks.connections.typos import find_typo

RULE = 'likely-misspelling'


@pytest.mark.parametrize(
    ('word', 'option'),
    [
        ('/camrea', '/camera'),
        ('/left/camrea', '/left/camera'),
        ('/lfet/camera', '/left/camera'),
        ('/front_lidar_scna', '/front_lidar_scan'),
        ('/Camera', '/camera'),
        ('/trajetcori', '/trajectory'),
        ('/cmd_vle', '/cmd_vel'),
    ],
)
def test_a_slip_is_found(word, option):
    assert find_typo(word, [option]) == option


@pytest.mark.parametrize(
    ('word', 'option'),
    [
        ('/camera_1', '/camera_2'),
        ('/arm_l', '/arm_r'),
        ('/map', '/mop'),
        ('/cmd_vell', '/cmd_vel'),
        ('/scan', '/left/scan'),
        ('/lfet/camrea', '/left/camera'),
    ],
)
def test_another_name_is_no_typo(word, option):
    assert find_typo(word, [option]) is None


WAITS = """
  camera:
    publishers: {image: {type: std_msgs/msg/String, external: true}}
    timers: {take: {period: 1, publish: image, message: x}}
    services: {reset: {type: std_srvs/srv/Empty, behaviour: parts:reset}}
  viewer:
    wait_for: {KIND: NAME}
"""
CODE = 'def reset(node, request): ...'


@pytest.mark.parametrize(
    ('kind', 'name', 'near'),
    [
        ('node', 'camrea', 'camera'),
        ('node', '/camrea', '/camera'),
        ('topic', 'imgae', 'image'),
        ('service', 'rest', 'reset'),
        ('service', 'restart', None),
    ],
)
def test_what_is_waited_for_is_no_misspelt_name(check, kind, name, near):
    nodes = WAITS.replace('KIND', kind).replace('NAME', name)
    what = f"a {kind} '/{name.lstrip('/')}' is nowhere in this system"
    assert check(nodes, CODE, rule=RULE, installed=False) == ([what] if near else [])


@pytest.mark.parametrize(
    ('kind', 'wrong', 'right'),
    [
        ('topic', '/frnt/scan', '/front/scan'),
        ('service', 'docc/start', 'dock/start'),
        ('action', '/dokc', '/dock'),
        ('service', '/other/get_paramters', '/other/get_parameters'),
        ('node', '/drivr', '/driver'),
    ],
)
def test_what_is_elsewhere_has_its_name_from_what_uses_it(check, kind, wrong, right):
    nodes = """
  n:
    wait_for: {KIND: NAME}
    subscriptions: {/front/scan: {type: std_msgs/msg/String, external: true, behaviour: parts:hear}}
    service_clients: {dock/start: {type: std_srvs/srv/Empty, external: true}}
    action_clients: {/dock: {type: test_msgs/action/Fibonacci, external: true}}
    on_start: parts:go
  other: {}
processes:
  driver: {command: ['true'], name: driver}
""".replace('KIND', kind)
    code = """
        def hear(node, message): ...
        def go(node):
            node.call('dock/start', {})
            node.send_goal('/dock', {})
    """
    assert check(nodes.replace('NAME', wrong), code, installed=False) == [(4, RULE)]
    assert check(nodes.replace('NAME', right), code, installed=False) == []


@pytest.mark.ros
def test_the_installed_ros_remaps_actions_as_its_version_says(domain_id):
    code = """
        import rclpy
        from rclpy.action import ActionServer
        from test_msgs.action import Fibonacci
        rclpy.init(args=['--ros-args', '-r', 'do:=done'])
        node = rclpy.create_node('n')
        server = ActionServer(node, Fibonacci, 'do', lambda goal: None)
        print([name for name, _ in node.get_service_names_and_types() if '/_action/' in name][0])
        rclpy.shutdown()
    """
    command = [sys.executable, '-c', dedent(code)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    # The middleware may print, too.
    named = done.stdout.splitlines()[-1]
    assert named.startswith('/done/' if remaps_actions() else '/do/')


def test_a_remapping_rule_is_for_no_misspelt_name(check):
    nodes = """
  camera:
    remap: {imgae: /front/image, tf: /tf}
    publishers: {image: {type: std_msgs/msg/String, external: true}}
    timers: {take: {period: 1, publish: image, message: x}}
"""
    assert check(nodes, installed=False) == [(4, RULE)]
    assert check(nodes.replace('imgae', 'image'), installed=False) == []


def test_rules_of_processes_have_names_of_ros(check):
    nodes = """
  n: {}
processes:
  driver: {command: [true], remap: {a//b: c, d: e f, g: /h}}
"""
    assert check(nodes) == [(5, 'bad-name'), (5, 'bad-name')]
