"""A system in launch files, and as one: with the real `launch`, which is on no registry."""

import os
import signal
import subprocess
import sys

import pytest

pytest.importorskip('launch_ros')

SYSTEM = """\
version: 1
args:
  name: {type: string, default: "Al $x", description: Who.}
  twice: {type: string, default: "{{ name }}!"}
nodes:
  hello:
    parameters: {name: "{{ twice }}"}
    on_start: parts:say
"""
PARTS = """
def say(node):
    node.logger.info(f'HELLO {node.parameters.name}')
"""
RUN = """
import sys
from launch import LaunchDescription, LaunchIntrospector, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import AnyLaunchDescriptionSource
file, *words = sys.argv[1:]
source = AnyLaunchDescriptionSource(file)
given = [word.split(':=') for word in words]
service = LaunchService()
service.include_launch_description(
    LaunchDescription([IncludeLaunchDescription(source, launch_arguments=given)])
)
description = source.get_launch_description(service.context)
print(LaunchIntrospector().format_launch_description(description))
sys.exit(service.run())
"""
XML = """<launch>
  <arg name="who" default="Zoe"/>
  <composer file="robot.composer.yaml" on_exit="shutdown">
    <arg name="name" value="$(var who)"/>
  </composer>
</launch>
"""
PYTHON = """
from composer.launch_files.launch_actions import ComposerSystem
from launch import LaunchDescription

def generate_launch_description():
    return LaunchDescription([ComposerSystem(file='robot.composer.yaml')])
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    ('name', 'text', 'words', 'said'),
    [
        ('robot.composer.yaml', SYSTEM, (), 'HELLO Al $x!'),
        ('robot.composer.yaml', SYSTEM, ('name:=Bo',), 'HELLO Bo!'),
        ('robot.composer.yaml', SYSTEM, ('twice:=Ed',), 'HELLO Ed'),
        ('a.launch.xml', XML, (), 'HELLO Zoe!'),
        ('a.launch.py', PYTHON, (), 'HELLO Al $x!'),
    ],
)
def test_launch_runs_a_system(tmp_path, domain_id, name, text, words, said):
    for file, content in (
        ('robot.composer.yaml', SYSTEM),
        ('parts.py', PARTS),
        ('run.py', RUN),
        (name, text),
    ):
        (tmp_path / file).write_text(content)
    process = subprocess.Popen(
        [sys.executable, 'run.py', name, *words],
        cwd=tmp_path,
        env=os.environ | {'ROS_DOMAIN_ID': str(domain_id)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    lines = []
    try:
        for line in process.stdout:
            lines.append(line)
            if 'ready in' in line:
                # As a terminal does, to all of its foreground.
                os.killpg(process.pid, signal.SIGINT)
        process.wait(60)
    finally:
        process.kill()
        process.stdout.close()
    shown = ''.join(lines)
    assert said in shown, shown
    assert '(nodes: /hello)' in shown
    assert '[composer-1]: process has finished cleanly' in shown
