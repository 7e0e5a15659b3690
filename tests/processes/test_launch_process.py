"""A process that runs a launch file: what `ros2` is given, and how all of it ends.

The real `ros2 launch` is on no registry: a stand-in does as it does, and ends its own programs.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros

ROS2 = f"""#!{sys.executable} -IS
import os, signal, sys, time
if os.fork() == 0:
    signal.signal(signal.SIGINT, lambda *_: print('child: interrupted', flush=True))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(print('child: ended', flush=True)))
    print('child: is there', flush=True)
    while True:
        time.sleep(0.01)
def end(*_):
    os.kill(0, signal.SIGTERM)
    os.wait()
    sys.exit(0)
signal.signal(signal.SIGTERM, signal.SIG_IGN)
signal.signal(signal.SIGINT, end)
print('ros2', *sys.argv[1:], flush=True)
while True:
    time.sleep(0.01)
"""


@pytest.fixture
def system(tmp_path, monkeypatch):
    (tmp_path / 'bin').mkdir()
    (tmp_path / 'bin/ros2').write_text(ROS2)
    (tmp_path / 'bin/ros2').chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path / 'bin'), prepend=os.pathsep)
    (tmp_path / 'nav.launch.xml').write_text('<launch><arg name="sim" default="a"/></launch>')
    path = tmp_path / 'system.yaml'
    path.write_text(
        'version: 1\nargs: {sim: true}\nprocesses:\n  nav:\n    launch: nav.launch.xml\n'
        '    arguments: {sim: "{{ sim }}"}\n    restart: {when: always, delay: 0}\n'
    )
    return path


def test_ros2_launch_is_run_and_ends_its_own_programs(compose, system):
    child = compose.run(system, 'sim:=false')
    child.wait_for_line('child: is there')
    path = system.parent / 'nav.launch.xml'
    assert child.wait_for_line('ros2 launch').endswith(
        f'ros2 launch --noninteractive {path} sim:=false'
    )
    assert child.stop() == 0
    assert child.matching('child: ended')
    assert not child.matching('interrupted')


def test_a_launch_that_was_killed_starts_again_when_its_programs_are_gone(compose, system):
    child = compose.run(system)
    child.wait_for_line('child: is there')
    ros2 = child.wait_for_line('ros2 launch') and find_ros2(system)
    os.kill(ros2, 9)
    child.wait_for_line('ros2 launch', times=2)
    child.wait_for_line('child: is there', times=2)
    assert len(find_children(system)) == 2
    assert child.stop() == 0


def test_a_launch_that_lost_the_signal_as_it_started_gets_it_again(compose, system):
    ros2 = system.parent / 'bin/ros2'
    ros2.write_text(ROS2.replace('SIGINT, end)', 'SIGINT, lambda *_: signal.signal(2, end))'))
    system.write_text(system.read_text() + '    stop: {timeout: 2}\n')
    child = compose.run(system)
    child.wait_for_line('ros2 launch')
    assert child.stop() == 0
    assert child.matching("'nav' did not end within 1 s of SIGINT, and gets SIGINT again")
    assert child.matching('child: ended')


def find_children(system):
    """Return the processes with the launch file in their command line."""
    found = []
    for process in Path('/proc').glob('[0-9]*'):
        with suppress(OSError):
            words = (process / 'cmdline').read_bytes().split(b'\0')
            if str(system.parent / 'nav.launch.xml').encode() in words:
                found.append(int(process.name))
    return sorted(found)


def find_ros2(system):
    return min(find_children(system))
