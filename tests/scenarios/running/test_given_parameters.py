"""Parameters that a case gives take the place of those in the files of its system."""

from pathlib import Path
from textwrap import dedent

import pytest

from composer.language.pipeline import load_system
from composer.scenarios.running.case_run import with_parameters

SYSTEM = """
    version: 1
    defaults: {namespace: robot}
    nodes:
      arm:
        parameters: {limit: {type: double, default: 1.5}, joints: [1.0], name: left}
        parameter_files: [arm.yaml]
      base: {parameters: {limit: 2.5}}
"""
FILE = '/robot/arm:\n  ros__parameters: {limit: 3.5}\n'


@pytest.fixture
def system(tmp_path):
    (tmp_path / 'arm.yaml').write_text(FILE)
    (tmp_path / 'system.yaml').write_text(dedent(SYSTEM))
    return load_system(tmp_path / 'system.yaml')


def test_values_become_those_of_their_types(system):
    given = {'/robot/arm': {'limit': 2, 'joints': [1, 2.5]}}
    changed = with_parameters(system, given).spec.nodes
    values = {name: spec.value for name, spec in changed['arm'].parameters.items()}
    assert values == {'limit': 2.0, 'joints': [1.0, 2.5], 'name': 'left'}
    assert isinstance(values['limit'], float)
    assert changed['base'] == system.spec.nodes['base']


def test_they_win_over_parameter_files(system, tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    arm = with_parameters(system, {'/robot/arm': {'limit': 2}}).spec.nodes['arm']
    first, last = arm.parameter_files
    assert first == system.spec.nodes['arm'].parameter_files[0]
    assert Path(last.file).read_text() == '/robot/arm:\n  ros__parameters:\n    limit: 2.0\n'


def test_without_any_the_system_stays_as_it_is(system):
    assert with_parameters(system, {}) is system
