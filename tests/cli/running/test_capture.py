"""`composer capture`: foreign nodes become declarations, and nodes beside them are checked."""

import pytest

pytest.importorskip('rclpy')

from composer.checks.checker import check_system
from composer.cli.main import run as run_command
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from tests.running import ROOT

pytestmark = pytest.mark.ros

# What the foreign camera and viewer lack: somebody who hears the one, and speaks to the other.
BESIDE = """
nodes:
  speaker:
    namespace: /left
    publishers: {words: std_msgs/msg/String}
    timers: {speak: {rate: 1, publish: words, message: {data: hello}}}
  detector:
    namespace: /left
    subscriptions:
      seen: {type: sensor_msgs/msg/Image, topic: camera/image, qos: sensor_data, publish: copy}
    publishers: {copy: {type: sensor_msgs/msg/Image, external: true}}
"""


@pytest.fixture
def run(domain_id, tmp_path, start_program, monkeypatch, capsys):
    """Return a function that starts foreign nodes, and returns what a command says of them."""
    monkeypatch.chdir(tmp_path)

    def capture(roles, *words):
        if roles:
            child = start_program(ROOT / 'tests' / 'foreign_nodes.py', *roles)
            assert child.stdout.readline() == 'ready\n'
        code = run_command(['capture', *words])
        return (code, *capsys.readouterr())

    return capture


def check(path, text):
    path.write_text(text)
    findings = check_system(load_system(path), InterfaceCatalogue())
    return [each for each in findings if each.rule != 'missing-program']


def test_what_is_captured_is_checked_beside_nodes_of_a_system(run, tmp_path):
    code, _, err = run([])
    assert code == 1
    assert 'there are no nodes on this ROS graph (ROS_DOMAIN_ID ' in err
    assert run(['camera', 'viewer'], '-o', 'captured.yaml') == (0, '', '')
    code, _, err = run([], 'viewr')
    assert code == 1
    assert "there is no node 'viewr' on this ROS graph (ROS_DOMAIN_ID " in err
    assert "did you mean 'viewer'?" in err
    text = (tmp_path / 'captured.yaml').read_text()
    path = tmp_path / 'robot.yaml'
    assert not check(path, text)
    system = text + BESIDE
    assert not check(path, system)
    for old, new, rule in [
        ('~/image:\n            type: sensor_msgs/msg/Image', None, 'conflicting-types'),
        ('qos: sensor_data, publish', 'qos: 10, publish', 'incompatible-qos'),
        ('topic: camera/image', 'topic: camera/imgae', 'no-publisher'),
        ('{words: std_msgs', '{worsd: std_msgs', 'no-subscription'),
        ('namespace: /left\n    nodes:\n      camera:', None, 'no-publisher'),
        ('camera/enable: std_srvs', 'camera/enabel: std_srvs', 'no-server'),
    ]:
        assert old in system
        wrong = system.replace(old, new or old.replace('Image', 'Imu').replace('/left', '/lefft'))
        assert rule in [each.rule for each in check(path, wrong)], old

    process = load_system(tmp_path / 'captured.yaml').spec.processes['camera']
    (camera,) = process.nodes
    assert camera.full_name == '/left/camera'
    rate = camera.parameters['rate']
    assert (rate.type, rate.value, rate.description) == ('double', 30.0, 'Images a second.')
    assert (rate.minimum, rate.maximum, rate.step) == (1.0, 60.0, 0.5)
    assert camera.parameters['frame'].read_only
    assert camera.parameters['size'].value == [640, 480]
    assert camera.parameters['text'].value == 'a: {{ b }}\n"c" # d'
    assert camera.declares_all_parameters
    assert camera.sections['publishers']['/robot_description'].qos.policies == {
        'durability': 'transient_local'
    }
    assert set(camera.sections['services']) == {'~/enable'}
    assert set(camera.sections['actions']) == {'move'}
    assert 'rosout' not in text
    assert '_action' not in text


def test_nodes_of_one_name_and_nodes_that_do_not_answer_are_told_apart(run, tmp_path):
    roles = ['camera', 'right_camera', 'silent', 'hung']
    code, _, err = run(roles, '--timeout', '2', '-o', 'all.yaml')
    assert code == 1
    assert sorted(err.splitlines()) == [
        "warning: node '/hung': it did not answer within 2 s: its parameters are not known",
        "warning: node '/silent': it has no parameter services: its parameters are not known",
    ]
    text = (tmp_path / 'all.yaml').read_text()
    assert not check(tmp_path / 'all.yaml', text)
    spec = load_system(tmp_path / 'all.yaml').spec
    assert set(spec.processes) == {'left_camera', 'right_camera', 'silent', 'hung'}
