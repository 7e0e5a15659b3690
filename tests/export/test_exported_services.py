"""Exported units, run by a real service manager."""

import os
import shlex
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from tests.running import ROOT, reserved_domain

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
hosts: {base: {address: 127.0.0.1}, arm: {address: 127.0.0.2, folder: arm}}
network: {discovery: peers}
nodes:
  talker:
    host: base
    worker: speech
    publishers: {chatter: {type: std_msgs/msg/String, external: true}}
    timers:
      tick: {period: 0.1, publish: chatter, message: {data: "{{ env('ROBOT_WORD') }}"}}
processes:
  helper: {command: [sleep, '1000'], host: arm}
"""


@pytest.fixture
def robot(tmp_path, monkeypatch):
    """Return a system in a folder, and under a name, that must be escaped."""
    folder = tmp_path / 'my $HOME %h "robot"'
    folder.mkdir()
    (folder / 'pyproject.toml').touch()
    (folder / 'a robot.yaml').write_text(SYSTEM)
    monkeypatch.setenv('ROBOT_WORD', 'hello')
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path / 'logs'))
    monkeypatch.setenv('PYTHONPATH', str(ROOT))
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        yield folder / 'a robot.yaml'


def test_units_run_reload_and_stop_the_parts_of_a_system(tmp_path, robot, service_manager):
    folder = tmp_path / 'units'
    words = [sys.executable, '-m', 'composer']
    subprocess.run(
        [*words, 'export', 'systemd', robot.name, '--output', folder], cwd=robot.parent, check=True
    )
    units = {each.name: each.read_text() for each in sorted(folder.iterdir())}
    names = ['composer-a\\x20robot@arm.service', 'composer-a\\x20robot@base.service']
    assert [*units] == names
    environment = tmp_path / 'manager' / 'composer' / 'a_robot.env'
    environment.parent.mkdir(parents=True)
    environment.write_text('ROBOT_WORD="a word"\n')
    del os.environ['ROBOT_WORD']
    composer = shlex.join(words)
    output = service_manager(
        units,
        f"""
        set -e
        units={shlex.quote(shlex.join(names))}
        eval "systemctl --user start $units"
        {composer} ps | grep -o '^a robot@[a-z]*  *running'
        systemctl --user reload {shlex.quote(names[1])}
        eval "systemctl --user stop $units"
        eval "systemctl --user show --property=Result,ActiveState $units"
        """,
    )
    assert output.splitlines() == [
        'a robot@arm   running',
        'a robot@base  running',
        'Result=success',
        'ActiveState=inactive',
        '',
        'Result=success',
        'ActiveState=inactive',
    ]
