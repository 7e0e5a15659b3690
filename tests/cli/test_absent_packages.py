"""Packages that are not installed: errors with ROS 2, and what is not checked without."""

import sys

import pytest

import composer
from composer.cli import main as cli

SYSTEM = """\
version: 1
include:
  arm: {file: package://arm_driver/config/arm.yaml, namespace: left}
nodes:
  rover:
    parameters: {map: "{{ find('vendor_maps') }}/hall.yaml"}
    parameter_files: [package://arm_driver/config/rover.yaml]
    wait_for: {node: left/driver}
    publishers: {out: std_msgs/msg/String}
    subscriptions: {state: {type: std_msgs/msg/String, publish: out}}
  "{{ find('vendor_maps') }}_x": {}
processes:
  viewer: {command: [sh], cwd: "package://arm_driver/x"}
  driver: {package: arm_driver, executable: driver}
"""
NOTE = '6 uses of packages that are not installed (arm_driver, vendor_maps)'


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Return exit code, standard output and standard error of a command."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rover.yaml').write_text(SYSTEM)

    def run(*arguments):
        code = cli.run(list(arguments))
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def no_ros(tmp_path, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))


@pytest.mark.usefixtures('no_ros')
def test_without_ros_they_are_noted_and_nothing_hangs_on_them(run):
    code, out, err = run('check', 'rover.yaml')
    assert (code, out) == (0, 'rover.yaml: ok, 1 node\n')
    assert err.endswith(f'; {NOTE}\n')
    assert composer.check('rover.yaml') == []
    code, out, _ = run('check', 'rover.yaml', '--strict-packages')
    assert code == 1
    assert out.count('error[uninstalled-package]: no package ') == 5
    assert out.count('error[missing-package]: no package ') == 1


@pytest.mark.usefixtures('no_ros')
def test_without_ros_a_start_fails(run):
    code, out, err = run('up', 'rover.yaml')
    assert (code, out) == (1, '')
    assert "rover.yaml:3:15: error[uninstalled-package]: no package 'arm_driver'" in err


@pytest.mark.ros
def test_with_ros_they_are_errors(run):
    code, out, err = run('check', 'rover.yaml')
    assert code == 1
    assert out.count('error[') == 6
    assert err == '6 errors in 1 file\n'
