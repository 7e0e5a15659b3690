"""What a file without findings has is counted."""

import pytest

from composer.cli.main import run


@pytest.mark.parametrize(
    ('system', 'counted'),
    [
        ('nodes: {}', '0 nodes'),
        ('processes: {a: {command: [sh]}}', '1 external process'),
        ('processes: {a: {command: [sh]}, b: {command: [sh]}}', '2 external processes'),
        ('nodes: {n: {}}\nprocesses: {a: {command: [sh]}}', '1 node'),
    ],
)
def test_a_system_of_external_processes_alone_counts_these(tmp_path, capsys, system, counted):
    (tmp_path / 'a.yaml').write_text(f'version: 1\n{system}\n')

    assert run(['check', str(tmp_path / 'a.yaml')]) == 0
    assert capsys.readouterr().out.endswith(f'a.yaml: ok, {counted}\n')
