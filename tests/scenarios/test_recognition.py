"""Scenario files are known by their name, their schema, or their keys."""

import pytest

from composer.scenarios.recognition import is_scenario_file


@pytest.mark.parametrize(
    ('name', 'text'),
    [
        ('a.scenario.yaml', ''),
        ('a.scenario.yml', 'nodes: {}'),
        ('a.yaml', '# yaml-language-server: $schema=../schemas/scenario.schema.json\n'),
        ('a.yaml', 'version: 1\nsystem: {file: a.yaml}\ncases: {}\n'),
        ('a.yaml', 'cases:\n  a: 1\nsystem:\n  file: b\n'),
    ],
)
def test_what_is_meant_as_scenarios_is_known(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    assert is_scenario_file(path)


@pytest.mark.parametrize(
    'text',
    [
        'version: 1\nnodes: {}\n',
        'version: 1\ncases: {}\n',
        'a:\n  system: 1\n  cases: 2\n',
        '# yaml-language-server: $schema=../schemas/composer.schema.json\n',
    ],
)
def test_other_files_are_left_alone(tmp_path, text):
    path = tmp_path / 'a.yaml'
    path.write_text(text)
    assert not is_scenario_file(path)
    assert not is_scenario_file(tmp_path / 'none.yaml')
