"""Large messages between workers go through shared memory, of which each process has enough."""

import os
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import pytest
import yaml

from composer.errors import ComposerError
from composer.language.pipeline import load_system
from composer.network.transport_profile import (
    PROFILE,
    PROFILE_VARIABLES,
    SEGMENT_BYTES,
    shared_memory_variables,
)

OURS = dict.fromkeys(PROFILE_VARIABLES, PROFILE)
SLEEP = {'command': ['sleep', '1']}

CODE = """
    LAST = 19

    def take(node):
        node.state.count += 1
        return {'data': f'{node.state.count} ' + 'x' * 1_200_000}

    def ignore(node, picture):
        pass

    def see(node, image):
        number = int(image.data.split()[0])
        node.state.numbers.append(number)
        numbers = node.state.numbers
        if number - numbers[0] >= LAST and not node.state.has_told:
            node.state.has_told = True
            print(f'{node.name} has {len(numbers)}, most', flush=True)
"""
CAMERA_NODES = """
  camera:
    worker: vision
    state: {count: 0}
    publishers: {image: {type: std_msgs/msg/String, topic: image, qos: sensor_data}}
    timers: {take: {rate: 20, behaviour: parts:take, publish: image}}
  detector:
    worker: detection
    state: {numbers: [], has_told: false}
    subscriptions:
      image: {type: std_msgs/msg/String, topic: image, qos: sensor_data, behaviour: parts:see}
"""
EYE = """
version: 1
nodes:
  eye: {publishers: {seen: {type: sensor_msgs/msg/Image, topic: seen}}}
"""
HEARS_EYE = """
      seen: {type: sensor_msgs/msg/Image, topic: seen, behaviour: parts:ignore}
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def load(nodes, **more):
        path = tmp_path / 'robot.yaml'
        path.write_text(yaml.safe_dump({'version': 1, 'nodes': nodes, **more}))
        system = load_system(path)
        assert not system.diagnostics
        return system.spec

    return load


@pytest.fixture
def give_room(monkeypatch):
    def give_room(size):
        room = SimpleNamespace(f_bavail=size // 4096, f_frsize=4096)
        monkeypatch.setattr(os, 'statvfs', lambda _folder: room)

    give_room(2**40)
    return give_room


@pytest.mark.parametrize(
    ('nodes', 'shell', 'expected'),
    [
        ({'planner': {}}, {}, {}),
        ({'planner': {'worker': 'w'}}, {}, OURS),
        ({'planner': {'worker': 'w'}}, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}, OURS),
        ({'planner': {'worker': 'w'}}, {'ROS_DISCOVERY_SERVER': '127.0.0.1:11811'}, OURS),
        ({'planner': {'worker': 'w'}}, {'RMW_IMPLEMENTATION': 'rmw_zenoh_cpp'}, {}),
        ({'planner': {'worker': 'w'}}, {'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}, {}),
        ({'planner': {'worker': 'w'}}, {'FASTRTPS_DEFAULT_PROFILES_FILE': 'my.xml'}, {}),
        ({'planner': {'worker': 'w'}}, {'FASTDDS_DEFAULT_PROFILES_FILE': 'my.xml'}, {}),
    ],
)
@pytest.mark.usefixtures('give_room')
def test_workers_get_the_profile_unless_transports_are_chosen(load, nodes, shell, expected):
    assert shared_memory_variables(load(nodes), shell) == expected


@pytest.mark.parametrize('name', ['DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml'])
@pytest.mark.usefixtures('give_room')
def test_a_profile_in_the_working_directory_stays_alone(load, tmp_path, name):
    (tmp_path / name).touch()
    assert shared_memory_variables(load({'planner': {'worker': 'w'}}), {}) == {}


def test_too_little_room_is_an_error_with_figures(load, give_room):
    nodes = {'planner': {'worker': 'w'}, 'driver': {'worker': 'v'}, 'pilot': {'worker': 'w'}}
    spec = load(nodes, processes={'server': SLEEP})
    give_room(4 * SEGMENT_BYTES)
    assert shared_memory_variables(spec, {}) == OURS
    give_room(4 * SEGMENT_BYTES - 4096)
    with pytest.raises(ComposerError) as raised:
        shared_memory_variables(spec, {})
    assert str(raised.value) == (
        '/dev/shm has room for 63 MB, and 4 processes with large segments need 64 MB: messages of '
        'more than 512 KB between workers go over UDP, where they may be lost'
    )


def test_the_room_that_is_checked_is_what_the_profile_takes():
    tree = ET.parse(PROFILE)
    sizes = [int(each.text) for each in tree.iter() if each.tag.endswith('segment_size')]
    assert sizes == [SEGMENT_BYTES]


@pytest.mark.usefixtures('shared_memory')
@pytest.mark.ros
def test_large_messages_of_best_effort_cross_between_workers_that_an_edit_adds(compose):
    child = compose(EYE, CODE, '--watch')
    child.wait_until_ready()
    compose.write(f'{EYE}{CAMERA_NODES}{HEARS_EYE}', CODE)
    child.wait_for_line('network: the process of the system has little shared memory')
    line = child.wait_for_line('detector has')
    assert child.stop() == 0
    # The first that arrives, and 19 more were sent.
    arrived = int(line.split()[2].rstrip(','))
    assert arrived >= 17


@pytest.mark.usefixtures('shared_memory')
@pytest.mark.ros
def test_the_workers_of_a_start_get_the_profile(compose):
    code = """
        import os

        def tell(node):
            node.logger.info(os.environ['FASTDDS_DEFAULT_PROFILES_FILE'])
    """
    child = compose('version: 1\nnodes: {n: {worker: w, on_start: parts:tell}}\n', code)
    assert child.wait_for_line('[n]: ').endswith(f': {PROFILE}')
    assert child.stop() == 0
