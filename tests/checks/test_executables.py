"""Processes: what must be installed, and what need not be."""

from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

SYSTEM = """
version: 1
args: {simulation: %s}
nodes: {other: {}}
processes:
  driver: {when: "{{ not simulation }}", package: vendor_camera, executable: driver}
"""


@pytest.mark.parametrize(
    ('simulation', 'messages'),
    [('true', []), ('false', ["no package 'vendor_camera' is installed"])],
)
def test_a_process_that_is_left_out_may_be_of_another_machine(
    tmp_path, monkeypatch, simulation, messages
):
    (tmp_path / 'share/ament_index/resource_index/packages').mkdir(parents=True)
    (tmp_path / 'share/ament_index/resource_index/packages/other').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    path = tmp_path / 'system.yaml'
    path.write_text(SYSTEM % simulation)

    findings = check_system(load_system(path), InterfaceCatalogue())

    assert [finding.message for finding in findings] == messages


@pytest.mark.parametrize(
    ('process', 'messages'),
    [
        ('{command: [sh, -c, exit]}', []),
        ('{command: [s_h]}', ["there is no program 's_h' on the PATH"]),
        ('{command: [own], env: {PATH: bin}}', []),
        ('{command: [sh], env: {PATH: bin}}', ["there is no program 'sh' on the PATH"]),
        (
            '{command: [./not_here]}',
            ["there is no program './not_here' here, where a system without 'cwd' runs it"],
        ),
        ('{command: [./wno], cwd: bin}', ["there is no program 'bin/wno'"]),
        ('{command: [./text], cwd: bin}', ["'bin/text' is not executable"]),
        ('{command: [/bin/none]}', ["there is no program '/bin/none'"]),
        ('{command: [sh], cwd: nib}', ["there is no folder 'nib' to run in"]),
        ('{command: [sh, bin/text]}', []),
        ('{command: [sh, -e, bin/txet, x]}', ["there is no script 'bin/txet'"]),
        ('{command: [python3, -u, none.py], cwd: bin}', ["there is no script 'none.py'"]),
        ('{command: [python3, -m, none.py]}', []),
        ('{command: ["{{ program }}"]}', []),
    ],
)
def test_programs_and_folders_are_those_of_this_machine(tmp_path, monkeypatch, process, messages):
    monkeypatch.chdir(tmp_path)
    Path('bin').mkdir()
    Path('bin/own').touch(mode=0o755)
    Path('bin/text').touch(mode=0o644)
    path = Path('system.yaml')
    path.write_text(
        'version: 1\nargs: {program: {type: string}}\nnodes: {}\n'
        f'processes:\n  driver: {process}\n'
    )

    findings = check_system(load_system(path), InterfaceCatalogue(prefixes=[]))

    assert [finding.message for finding in findings] == messages


def test_the_environment_of_a_process_has_values_that_ros_knows(tmp_path):
    path = tmp_path / 'system.yaml'
    path.write_text("""\
version: 1
nodes: {}
processes:
  one: {command: [sh], env: {ROS_DOMAIN_ID: '300', RMW_IMPLEMENTATION: rmw_of_a_container}}
  two: {command: [sh], env: {ROS_AUTOMATIC_DISCOVERY_RANGE: LOCAL, LOCAL: x}}
""")
    findings = check_system(load_system(path), InterfaceCatalogue())
    assert [(each.rule, each.span.line, each.span.text) for each in findings] == [
        ('bad-environment', 4, "'300'"),
        ('bad-environment', 5, 'LOCAL'),
    ]
