"""The levels of the ROS loggers."""

from pathlib import Path

import pytest

from composer.language.pipeline import load_system_text
from composer.runtime.logs import warn_of_unknown_loggers

SYSTEM = """
version: 1
nodes:
  talker: {namespace: /robot/arm}
  listener: {}
processes:
  driver: PROCESS
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    ('request_', 'process', 'advice'),
    [
        ('debug', '{command: [x]}', None),
        ('listener:=debug', '{command: [x]}', None),
        ('robot.arm.talker.part:=debug', '{command: [x]}', None),
        ('composer:=debug', '{command: [x]}', None),
        ('listner:=debug', '{command: [x]}', "did you mean 'listener'?"),
        ('/nonode:=debug', '{command: [x]}', 'there are: listener, robot.arm.talker'),
        ('nonode:=debug', '{package: cameras, executable: driver}', None),
    ],
)
def test_a_level_for_no_node_is_warned_of(capfd, request_, process, advice):
    spec = load_system_text(SYSTEM.replace('PROCESS', process), Path('system.yaml')).spec
    warn_of_unknown_loggers(spec, [request_])
    text = f"--log-level: this system has no node '{request_.partition(':=')[0]}' ({advice})\n"
    assert capfd.readouterr().err.partition('[composer]: ')[2] == (text if advice else '')
