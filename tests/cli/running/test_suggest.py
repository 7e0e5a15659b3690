"""`composer suggest`: from a running system, and from recordings of `/diagnostics`."""

import json
from typing import NamedTuple

import pytest
import yaml

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Int32

from composer.cli.main import run
from tests.recorded import write_recording

SYSTEM = """
version: 1
diagnostics: {period: 0.5}
nodes:
  left: {timers: {loop: {rate: 100, behaviour: parts:loop}}}
  right: {timers: {loop: {rate: 100, behaviour: parts:loop}}}
  idle: {timers: {tick: {rate: 1, behaviour: parts:rest}}}
"""
CODE = """
import time

def loop(node):
    end = time.monotonic() + 0.03
    while time.monotonic() < end:
        pass

def rest(node):
    pass
"""
PIPELINE = """
version: 1
nodes:
  camera:
    publishers: {image: {type: sensor_msgs/msg/Image}}
    timers: {shoot: {rate: 30, behaviour: parts:shoot, publish: image}}
  "cam_{{ side }}":
    foreach: {side: [left, right]}
    timers: {look: {rate: 1, behaviour: parts:rest}}
  detect:
    subscriptions: {image: {type: sensor_msgs/msg/Image, behaviour: parts:hear}}
"""
PIPELINE_CODE = """
def shoot(node):
    return {}

def hear(node, message):
    pass

def rest(node):
    pass
"""


class Entity(NamedTuple):
    """What is said of an entity; shares are in percent, and messages are lost in a second."""

    task: str
    cpu: object
    rate: float
    lost: int = 0


def diagnostics(*entities, system='system', second=0, **values):
    """Return a message as a system with four cores sends it."""

    def status(name, values):
        pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        return DiagnosticStatus(name=name, hardware_id=system, values=pairs)

    statuses = [status('/_composer_system: system', {'cores': 4, **values})]
    for each in entities:
        figures = {'cpu (%)': each.cpu, 'rate (Hz)': each.rate}
        statuses.append(status(each.task, {**figures, 'queue overruns': each.lost * second}))
    message = DiagnosticArray(status=statuses)
    message.header.stamp.sec = second
    return message


def record(path, *entities, seconds=3, **more):
    messages = [diagnostics(*entities, second=each, **more) for each in range(seconds)]
    return write_recording(path / 'run.mcap', {'/diagnostics': messages})


@pytest.fixture
def system(tmp_path, monkeypatch):
    """Return the file of the pipeline, in the folder where its behaviours are."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'parts.py').write_text(PIPELINE_CODE)
    path = tmp_path / 'system.yaml'
    path.write_text(PIPELINE)
    return path


BUSY = (
    Entity('/camera: timer shoot', 45, 10),
    Entity('/detect: subscription image', 50, 10, lost=20),
    Entity('/cam_left: timer look', 3, 1),
)


@pytest.mark.ros
def test_a_running_system_is_watched_and_its_layer_splits_it(compose, capsys, tmp_path):
    compose(SYSTEM, CODE).wait_until_ready()
    path, layer = tmp_path / 'system.yaml', tmp_path / 'split.yaml'
    words = ['--seconds', '2', '--cores', '4', '-o', str(layer), '--format', 'json']
    assert run(['suggest', str(path), *words]) == 0
    document = json.loads(capsys.readouterr()[0])
    assert document['gain'] > 1.2
    workers = {each['node']: each['suggested'] for each in document['nodes']}
    assert workers['/left'] != workers['/right']
    assert yaml.safe_load(layer.read_text()) == document['layer']
    assert run(['check', str(path), str(layer)]) == 0


def test_a_recording_says_what_to_split(system, capsys, tmp_path):
    recording = record(tmp_path, *BUSY)
    assert run(['suggest', str(system), '--recording', str(recording)]) == 0
    out = capsys.readouterr()[0]
    assert out == (
        'system: 1.0 of 4 cores used → 1.8, expected 1.8x\n'
        '  the process of the system: /camera 45%, /cam_left 3%, 1 without figures\n'
        '  worker detect: /detect 50%\n'
        '  messages between them: 4% of a core\n'
        '\n'
        f'the layer for it, as in composer up {system} split.yaml:\n'
        '\n'
        'nodes:\n'
        '  detect:\n'
        '    worker: detect\n'
    )


def test_the_cores_are_those_of_where_it_was_recorded(system, capsys, tmp_path):
    recording = record(tmp_path, *BUSY, cores=1)
    assert run(['suggest', str(system), '--recording', str(recording)]) == 0
    assert 'no split pays: all 1 core are used already' in capsys.readouterr()[0]
    words = ['--recording', str(recording), '--cores', '4', '--format', 'json']
    assert run(['suggest', str(system), *words]) == 0
    document = json.loads(capsys.readouterr()[0])
    assert document['cores'] == 4
    assert document['layer'] == {'nodes': {'detect': {'worker': 'detect'}}}


def test_what_is_dropped_and_late_is_what_there_is_to_do(system, capsys, tmp_path):
    late, dropping = Entity('/camera: timer shoot', 45, 15), BUSY[1]
    for entities, demand in (([late], 2.0), ([late, dropping], 1.0 + 20 * 2 / 3 / 10)):
        recording = record(tmp_path, *entities)
        words = ['--recording', str(recording), '--format', 'json']
        assert run(['suggest', str(system), *words]) == 0
        assert json.loads(capsys.readouterr()[0])['demand'] == pytest.approx(demand)


def test_nodes_that_a_layer_cannot_move_stay(system, capsys, tmp_path):
    busy = [Entity(f'/cam_{each}: timer look', 48, 0.5) for each in ('left', 'right')]
    recording = record(tmp_path, *busy)
    assert run(['suggest', str(system), '--recording', str(recording), '--format', 'json']) == 0
    assert json.loads(capsys.readouterr()[0])['layer'] == {'nodes': {}}


def test_the_size_of_recorded_messages_counts(system, capsys, tmp_path):
    from sensor_msgs.msg import Image

    images = [Image(data=bytes(8_000_000))] * 2
    messages = [diagnostics(*BUSY, second=each) for each in range(3)]
    topics = {'/diagnostics': messages, '/image': images}
    recording = write_recording(tmp_path / 'run.mcap', topics)
    assert run(['suggest', str(system), '--recording', str(recording), '--format', 'json']) == 0
    document = json.loads(capsys.readouterr()[0])
    assert document['after']['crossing'] == pytest.approx(10 * 8e6 * 3.75e-9 + 0.007, rel=0.1)


def other_topic(path):
    return write_recording(path / 'run.mcap', {'/number': [Int32(data=1)]})


def test_nodes_that_share_an_object_stay_together(system, capsys, tmp_path):
    (tmp_path / 'parts.py').write_text(
        PIPELINE_CODE.replace(
            'def shoot(node):\n', 'found = {}\n\ndef shoot(node):\n    found.get(1)\n'
        ).replace('message):\n    pass', 'message):\n    found[1] = message')
    )
    recording = record(tmp_path, *BUSY)
    assert run(['suggest', str(system), '--recording', str(recording), '--format', 'json']) == 0
    document = json.loads(capsys.readouterr()[0])
    workers = {each['node']: each['suggested'] for each in document['nodes']}
    assert workers['/camera'] == workers['/detect']


ERRORS = {
    'no diagnostics': (
        other_topic,
        "error: '{path}' has no messages of /diagnostics\n"
        "  help: record them with 'composer record', or 'composer up --record', while it works\n",
    ),
    'other system': (
        lambda path: record(path, *BUSY, system='robot'),
        "error: '{path}' says nothing about system 'system'\n  help: it is about: robot\n",
    ),
    'other nodes': (
        lambda path: record(path, Entity('/else: timer x', 1, 1)),
        "error: nothing was measured of the nodes of system 'system'\n"
        '  help: name the file that it ran with\n',
    ),
    'not measured': (
        lambda path: record(path, Entity('/detect: subscription image', '', 1)),
        "error: '{path}' does not say what the calls of 'system' cost\n"
        "  help: the figures 'cpu (%)' are missing\n",
    ),
}


@pytest.mark.parametrize('name', ERRORS)
def test_recordings_that_say_nothing_are_errors(system, capsys, tmp_path, name):
    make, expected = ERRORS[name]
    path = make(tmp_path)
    assert run(['suggest', str(system), '--recording', str(path)]) == 1
    assert capsys.readouterr() == ('', expected.format(path=path))


def test_a_file_that_exists_is_not_overwritten(system, capsys, tmp_path):
    recording = record(tmp_path, *BUSY)
    before = system.read_text()
    assert run(['suggest', str(system), '--recording', str(recording), '-o', str(system)]) == 2
    assert capsys.readouterr()[1].startswith(f"error: '{system}' exists, and is not overwritten")
    assert system.read_text() == before


def test_a_file_with_errors_is_reported(system, capsys, tmp_path):
    recording = record(tmp_path, *BUSY)
    system.write_text(PIPELINE.replace('timers:', 'tmers:'))
    assert run(['suggest', str(system), '--recording', str(recording)]) == 1
    assert "did you mean 'timers'?" in capsys.readouterr()[1]


def test_figures_of_another_split_are_refused(system, capsys, tmp_path):
    recording = record(tmp_path, *BUSY)
    layer = tmp_path / 'layer.yaml'
    layer.write_text('nodes: {detect: {worker: eyes}}\n')
    assert run(['suggest', str(system), str(layer), '--recording', str(recording)]) == 1
    assert capsys.readouterr()[1] == (
        "error: /detect ran in no worker, and the file says worker 'eyes'\n"
        '  help: name all layers that the system ran with\n'
    )
