"""The parts of two hosts, side by side: they make up the system, also after an edit."""

import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
defaults: {host: base}
workers: {eyes: {host: jetson}}
nodes:
  camera:
    worker: eyes
    publishers: {image: std_msgs/msg/String}
    timers: {take: {rate: 10, behaviour: 'on_jetson:take', publish: image}}
  lidar: {host: jetson}
  detector:
    subscriptions: {image: {type: std_msgs/msg/String, behaviour: 'parts:see'}}
"""
CODE = """
def see(node, image):
    node.logger.info(f'saw {image.data}')
"""


def test_each_part_runs_its_nodes_and_changes_with_the_files(compose):
    path = compose.write(SYSTEM, CODE)
    base = compose.run(path.name, '--host', 'base', '--watch')
    # The module of the camera is not there yet, and not missed.
    base.wait_for_line('system@base: 1 node ready')
    (compose.folder / 'on_jetson.py').write_text("def take(node):\n    return 'it'\n")
    jetson = compose.run(path.name, '--host', 'jetson', '--watch')
    jetson.wait_for_line('system@jetson: 2 nodes and 1 worker ready')
    base.wait_for_line('[detector]: saw it')

    # What goes here comes there.
    path.write_text(SYSTEM.replace('worker: eyes', 'host: base').replace('workers:', 'x-old:'))
    assert '+1 node' in base.wait_for_line('reloaded in')
    assert '-1 worker, -1 node' in jetson.wait_for_line('reloaded in')
    base.wait_for_line('[detector]: saw it', times=len(base.matching('saw it')) + 2)
    assert (base.stop(), jetson.stop()) == (0, 0)


def test_a_part_in_the_background_has_a_log_of_its_own(compose, monkeypatch, capfd):
    monkeypatch.chdir(compose.folder)
    monkeypatch.setenv('ROS_LOG_DIR', str(compose.folder / 'log'))
    path = compose.write(SYSTEM, CODE)
    composer = [sys.executable, '-m', 'composer']
    subprocess.run([*composer, 'up', path.name, '--host', 'base', '-d'], check=True)
    assert run(['down', 'system@base']) == 0
    capfd.readouterr()
    assert run(['logs', 'system@base']) == 0
    assert 'system@base: 1 node ready' in capfd.readouterr().out
    assert run(['logs', 'system']) == 1
