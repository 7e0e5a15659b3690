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
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, external: true}}
    timers:
      tick: {period: 0.1, publish: chatter, message: {data: "{{ env('ROBOT_WORD') }}"}}
processes:
  helper: {command: [sleep, '1000']}
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


def test_a_unit_runs_reloads_and_stops_the_system(tmp_path, robot, service_manager):
    units = tmp_path / 'units'
    words = [sys.executable, '-m', 'composer']
    subprocess.run(
        [*words, 'export', 'systemd', robot.name, '--output', units], cwd=robot.parent, check=True
    )
    (unit,) = units.iterdir()
    environment = tmp_path / 'manager' / 'composer' / 'a_robot.env'
    environment.parent.mkdir(parents=True)
    environment.write_text('ROBOT_WORD="a word"\n')
    del os.environ['ROBOT_WORD']
    composer = shlex.join(words)
    output = service_manager(
        {unit.name: unit.read_text()},
        f"""
        set -e
        unit={shlex.quote(unit.name)}
        systemctl --user start "$unit"
        echo "started: $(systemctl --user is-active "$unit")"
        {composer} ps 'a robot' | grep -o 'a robot  *running'
        systemctl --user reload "$unit"
        systemctl --user stop "$unit"
        systemctl --user show --property=Result,ActiveState "$unit"
        {composer} ps 'a robot' || echo "gone: $?"
        """,
    )
    assert 'started: active' in output
    assert 'running' in output
    assert 'Result=success\nActiveState=inactive\n' in output
    assert output.endswith('gone: 1\n')
