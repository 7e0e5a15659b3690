"""What cases have of the environment of their caller."""

import os
from pathlib import Path

from composer.scenarios.running.fixed_environment import fix_environment, isolated_environment

SHELL = {
    'PATH': '/bin',
    'AMENT_PREFIX_PATH': '/opt/ros/jazzy',
    'ROS_DISTRO': 'jazzy',
    'ROS_DOMAIN_ID': '7',
    'ROS_STATIC_PEERS': '10.0.0.1',
    'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp',
    'FASTRTPS_DEFAULT_PROFILES_FILE': 'profiles.xml',
    'RCUTILS_COLORIZED_OUTPUT': '1',
    'LC_NUMERIC': 'de_DE.UTF-8',
    'PYTHONHASHSEED': 'random',
    'TZ': 'Asia/Tokyo',
}


def test_what_says_where_things_are_stays():
    fixed = fix_environment(SHELL, '/log')
    kept = {name: fixed[name] for name in ('PATH', 'AMENT_PREFIX_PATH', 'ROS_DISTRO')}
    assert kept == {name: SHELL[name] for name in kept}


def test_nothing_else_of_ros_and_of_the_place_stays():
    fixed = fix_environment(SHELL, '/log')
    assert {'ROS_DOMAIN_ID', 'ROS_STATIC_PEERS', 'RMW_IMPLEMENTATION'}.isdisjoint(fixed)
    assert {'FASTRTPS_DEFAULT_PROFILES_FILE', 'RCUTILS_COLORIZED_OUTPUT'}.isdisjoint(fixed)
    assert (fixed['PYTHONHASHSEED'], fixed['TZ'], fixed['LC_ALL']) == ('0', 'UTC', 'C.UTF-8')
    assert fixed['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'OFF'
    assert fixed['ROS_LOG_DIR'] == '/log'
    assert 'LC_NUMERIC' not in fixed


def test_an_isolated_process_gets_its_environment_back(monkeypatch):
    monkeypatch.setenv('ROS_STATIC_PEERS', '10.0.0.1')
    before = dict(os.environ)
    with isolated_environment():
        assert 'ROS_STATIC_PEERS' not in os.environ
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'OFF'
        assert Path(os.environ['ROS_LOG_DIR']).is_dir()
    assert dict(os.environ) == before
