"""`composer doctor`: what it says of this computer, and of ones that lack something."""

import json
import subprocess
import sys

import pytest

from composer.cli import doctor, doctor_accesses


def run(tmp_path, *arguments, **environment):
    """Return what it finds, and its exit code."""
    words = [sys.executable, '-m', 'composer', 'doctor', *arguments]
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        done = subprocess.run(
            words, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False
        )
    assert 'Traceback' not in done.stdout + done.stderr
    return done.stdout, done.returncode


@pytest.mark.ros
@pytest.mark.parametrize(
    ('environment', 'code', 'told'),
    [
        (
            {
                'ROS_DOMAIN_ID': '200',
                'AMENT_PREFIX_PATH': '/none',
                'PYTHONPATH': '{}/python3.2/x',
            },
            0,
            [
                ('warning', 'ROS_DOMAIN_ID is 200', '0 to 101'),
                ('warning', "there is no folder '/none'", 'source'),
                ('warning', 'is for Python 3.2', ''),
                ('ok', 'a node has started', ''),
                ('ok', 'all that is used beside documented interfaces is there', ''),
            ],
        ),
        (
            {'RMW_IMPLEMENTATION': 'rmw_of_nobody', 'ROS_DISTRO': 'humble'},
            1,
            [
                ('error', 'a node cannot start', 'unset'),
                ('error', 'humble is sourced', 'Jazzy or later'),
            ],
        ),
        ({'ROS_LOG_DIR': '/proc/none'}, 1, [('error', '/proc/none', '')]),
    ],
    ids=['warnings', 'errors', 'no log'],
)
def test_what_is_wrong_is_told(tmp_path, domain_id, environment, code, told):
    (tmp_path / 'python3.2' / 'x').mkdir(parents=True)
    given = {name: value.format(tmp_path) for name, value in environment.items()}
    text, found_code = run(tmp_path, '--format', 'json', **given)
    for state, said, advice in told:
        found = [each for each in json.loads(text) if said in each['detail']]
        assert [each['state'] for each in found[:1]] == [state], text
        assert advice in found[0]['advice']
    assert found_code == code


def test_a_machine_without_wheels_is_told_what_to_do(monkeypatch):
    monkeypatch.setattr(doctor.importlib.util, 'find_spec', lambda name: None)
    monkeypatch.setattr(doctor.platform, 'machine', lambda: 'aarch64')
    assert doctor.examine('text') == 1


def test_little_shared_memory_and_no_multicast_are_told(monkeypatch):
    monkeypatch.setattr(doctor, '_LEAST_SHARED_BYTES', 1 << 60)
    monkeypatch.setattr(doctor, '_MULTICAST', ('10.0.0.1', 1))
    found = [*doctor._examine_memory(), *doctor._examine_network()]
    assert [each.state for each in found] == ['warning', 'warning']
    assert all(each.advice for each in found)


@pytest.mark.ros
def test_each_access_is_missed_where_it_is_not_there(node):
    assert not list(doctor_accesses.find_missing(node))
    without_all = object()
    missing = {each.name for each in doctor_accesses.find_missing(without_all)}
    assert missing == {'callback groups of rclpy', 'descriptors of parameters', 'end of Fast DDS'}
