"""The shipped systems to copy from, run by `composer up` among plain rclpy peers.

Each shows a part of the language; all are made of shipped behaviours alone.
"""

import os
import sys
import time
from itertools import count, pairwise
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, Vector3
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image, LaserScan, Range
from std_msgs.msg import Bool, Float64, String

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def up(compose):
    """Run a shipped system, with what is said after it, from the project's root."""

    def run(name, *arguments):
        child = compose.run(f'configs/{name}.yaml', *arguments, folder=ROOT)
        child.wait_until_ready()
        return child

    return run


@pytest.fixture
def publish_until(wait_for):
    """Publish a message again and again until something comes of it: peers meet one by one."""

    def publish_until(publisher, message, condition, what):
        def came():
            publisher.publish(message)
            return condition()

        wait_for(came, what)

    return publish_until


def driving(linear, angular=0.0):
    return Twist(linear=Vector3(x=linear), angular=Vector3(z=angular))


def nodes_of(peer):
    return {
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in peer.node.get_node_names_and_namespaces()
        if name != 'peer' and not name.startswith('_')
    }


LAYERS = {
    'in the warehouse, with an argument': (
        ['configs/sites/warehouse.yaml', 'robot:=rover'],
        'rover',
        'front rear',
        (1.0, 1.0),
        (6.0, 14.0),
    ),
    'in the harbour': (
        ['configs/sites/harbour.yaml'],
        'carrier',
        'front middle rear',
        (3.0, 1.0),
        (4.0, 8.0),
    ),
}


@pytest.mark.parametrize('case', LAYERS)
def test_the_wheels_of_the_robot_follow_the_governed_command(
    up, peer, wait_for, publish_until, case
):
    words, robot, ends, command, speeds = LAYERS[case]
    expected = {
        f'/{robot}/{end}_{side}_wheel': speed
        for end in ends.split()
        for side, speed in zip(('left', 'right'), speeds, strict=True)
    }
    heard = {name: peer.listen(Float64, f'{name}/speed') for name in expected}
    child = up('robot', *words)
    names = {*expected, f'/{robot}/governor'}
    wait_for(lambda: nodes_of(peer) == names, lambda: f'{names}, not {nodes_of(peer)}')
    commands = peer.advertise(Twist, f'/{robot}/cmd_vel')
    publish_until(commands, driving(*command), lambda: all(heard.values()), 'all wheels')

    assert {name: messages[0].data for name, messages in heard.items()} == pytest.approx(expected)
    assert child.stop() == 0


DRIVER = f"""\
#!{sys.executable}
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Image

rclpy.init()
node = rclpy.create_node('v4l2_camera')
size = list(node.declare_parameter('image_size', [0, 0]).value)
publisher = node.create_publisher(Image, 'image_raw', qos_profile_sensor_data)
image = Image(width=size[0], height=size[1])
node.create_timer(0.05, lambda: publisher.publish(image))
with suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node)
"""


@pytest.fixture
def installed_driver(tmp_path, monkeypatch):
    """Install a package `v4l2_camera` whose driver is plain rclpy."""
    prefix = tmp_path / 'prefix'
    index = prefix / 'share/ament_index/resource_index/packages'
    index.mkdir(parents=True)
    (index / 'v4l2_camera').touch()
    executable = prefix / 'lib/v4l2_camera/v4l2_camera_node'
    executable.parent.mkdir(parents=True)
    executable.write_text(DRIVER)
    executable.chmod(0o755)
    before = os.environ.get('AMENT_PREFIX_PATH')
    path = os.pathsep.join(filter(None, [str(prefix), before]))
    monkeypatch.setenv('AMENT_PREFIX_PATH', path)


def test_the_camera_is_a_driver_of_its_own_if_it_is_real(up, peer, wait_for, installed_driver):
    heard = peer.listen(Image, 'preview')
    child = up('camera', 'simulation:=false')
    wait_for(lambda: heard, 'a preview')

    assert (heard[0].width, heard[0].height) == (640, 480)
    nodes = {'/v4l2_camera', '/preview'}
    wait_for(lambda: nodes_of(peer) == nodes, lambda: f'{nodes}, not {nodes_of(peer)}')
    assert child.stop() == 0


@pytest.fixture
def python3(monkeypatch):
    """Let processes find the Python of the tests as `python3`."""
    monkeypatch.setenv('PATH', str(Path(sys.executable).parent), prepend=os.pathsep)


def test_the_managed_system_brings_the_scanner_up_and_waits_for_a_manager(
    up, peer, wait_for, python3
):
    nearest = peer.listen(Float64, '/rover/nearest')
    kept = peer.listen(LaserScan, '/rover/kept')
    child = up('managed')
    wait_for(lambda: nearest, 'a distance')
    assert nearest[0].data == 1.0
    assert not kept
    transitions = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE
    peer.change_state('/rover/mapper', *transitions)
    child.wait_for_line('Hello map!')
    wait_for(lambda: kept, 'a scan of the mapper')
    assert child.stop() == 0


def test_the_patrol_drives_a_program_whose_description_a_command_prints(
    up, peer, wait_for, python3
):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    described = peer.listen(String, '/patrol_1/robot_description', latched)
    distances = peer.listen(Float64, '/patrol_1/distance')
    child = up('patrol')
    wait_for(lambda: distances and distances[-1].data > 0.1, 'a distance')
    wait_for(lambda: described, 'the description')

    assert described[0].data == '<robot name="patrol_1"><link name="base_link"/></robot>\n'
    nodes = {f'/patrol_1/{name}' for name in ('patrol', 'odometer', 'base')}
    wait_for(lambda: nodes_of(peer) == nodes, lambda: f'{nodes}, not {nodes_of(peer)}')
    assert child.stop() == 0


@pytest.mark.usefixtures('python3', 'interface_cache')
def test_the_cell_loads_components_and_brings_one_to_active(up, peer, wait_for):
    judged = peer.listen(Bool, '/cell_1/too_hot')
    child = up('cell')
    wait_for(lambda: judged, 'a judgement')

    assert judged[0].data
    assert peer.call(GetState, '/cell_1/gripper/get_state').current_state.label == 'active'
    assert child.stop() == 0


def numbered_scan(number):
    scan = LaserScan(range_min=0.25, ranges=[3.0, 0.5, 2.0])
    scan.header.frame_id, scan.header.stamp.sec = 'laser', number
    return scan


def test_filters_make_scans_fewer_slower_and_smaller_and_select_commands(
    up, peer, wait_for, publish_until
):
    heard = {
        name: peer.listen(kind, name, 1000)
        for name, kind in {
            'slow_scan': LaserScan,
            'third_scan': LaserScan,
            'closest': Range,
        }.items()
    }
    child = up('filters')
    publisher = peer.advertise(LaserScan, 'scan')
    numbers = count(1)

    def publish():
        number = next(numbers)
        publisher.publish(numbered_scan(number))
        return number

    def numbers_of(name):
        return [message.header.stamp.sec for message in list(heard[name])]

    wait_for(lambda: publish() and all(heard.values()), 'scans by all filters')
    # Nobody promises that all scans are heard, so the next one waits until the last was.
    first, begun = next(numbers), time.monotonic()
    later = {name: [] for name in heard}
    while len(later['third_scan']) < 5 or len(later['slow_scan']) < 2:
        last = publish()
        wait_for(lambda: numbers_of('closest')[-1] == last, 'the scan')  # noqa: B023
        later = {name: [n for n in numbers_of(name) if n > first] for name in heard}
    took_sec = time.monotonic() - begun

    assert {later - earlier for earlier, later in pairwise(later['third_scan'])} == {3}
    assert len(later['slow_scan']) <= 2.0 * took_sec + 2
    assert len(later['slow_scan']) < len(later['closest'])
    nearest = heard['closest'][0]
    assert (nearest.header.frame_id, nearest.min_range, nearest.range) == ('laser', 0.25, 0.5)

    # Commands are passed on of the source that is selected.
    driven = peer.listen(Twist, 'base/cmd_vel')
    autopilot = peer.advertise(Twist, 'autopilot/cmd_vel')
    joystick = peer.advertise(Twist, 'joystick/cmd_vel')

    def drive_both_until(speed):
        def came():
            joystick.publish(driving(2.0))
            return any(each.linear.x == speed for each in driven)

        publish_until(autopilot, driving(1.0), came, f'the speed {speed}')

    drive_both_until(1.0)
    assert {each.linear.x for each in driven} == {1.0}
    change = Parameter('selected', value='joystick').to_parameter_msg()
    peer.call(SetParameters, 'command_mux/set_parameters', parameters=[change])
    drive_both_until(2.0)
    wrong = Parameter('selected', value='nobody').to_parameter_msg()
    answer = peer.call(SetParameters, 'command_mux/set_parameters', parameters=[wrong])
    assert not answer.results[0].successful
    assert child.stop() == 0


def test_the_monitor_warns_of_silence_and_tells_when_it_is_over(up, peer, wait_for, publish_until):
    verdicts = peer.listen(Bool, 'scan_ok')
    diagnostics = peer.listen(DiagnosticArray, '/diagnostics')
    child = up('monitor')

    def told():
        return {
            (status.level, status.message.split(' for ')[0])
            for array in list(diagnostics)
            for status in array.status
            if status.name == '/monitor: odometry'
        }

    child.wait_for_line('[WARN] [monitor]: scan: 0 messages/s, at least 5 expected')
    child.wait_for_line('[WARN] [monitor]: odometry: no message for ')
    wait_for(lambda: (b'\x01', 'no message') in told(), 'a warning among the diagnostics')
    wait_for(lambda: verdicts, 'a verdict')
    assert {verdict.data for verdict in verdicts} == {False}

    scans = peer.advertise(LaserScan, 'scan')
    odometry = peer.advertise(Odometry, 'odometry')

    def is_well():
        scans.publish(numbered_scan(1))
        return verdicts[-1].data and (b'\x00', 'OK') in told()

    publish_until(odometry, Odometry(), is_well, 'both topics to be well')
    child.wait_for_line('[INFO] [monitor]: scan: healthy again, ')
    assert child.stop() == 0
