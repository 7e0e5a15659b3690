"""What an edit of containers and their components does."""

import pytest

from composer.cli.main import run

SYSTEM = """\
version: 1
containers:
  perception:
    command: [sleep, '9']
    components:
      talker: {package: vendor, plugin: 'vendor::Talker', parameters: {word: a}}
      filter: {package: vendor, plugin: 'vendor::Filter', parameter_files: [values.yaml]}
"""
EDITS = {
    'a component comes and another one goes': (
        "talker: {package: vendor, plugin: 'vendor::Talker', parameters: {word: a}}",
        "other: {package: vendor, plugin: 'vendor::Other'}",
        [
            "- component 'talker' of 'perception' (system.yaml:6); lost: its state",
            "+ component 'other' of 'perception' (edited.yaml:6)",
        ],
    ),
    'one is loaded anew': (
        '{word: a}',
        '{word: b}, intra_process: true',
        [
            "± component 'talker' of 'perception': parameters.word a → b "
            '(system.yaml:6 → edited.yaml:6), '
            'intra_process false → true (system.yaml:6 → edited.yaml:6); '
            'a component takes this when it is loaded; lost: its state'
        ],
    ),
    'what it waits for counts later': (
        '{word: a}',
        '{word: a}, wait_for: {process: perception, state: running}, description: told',
        [
            "~ component 'talker' of 'perception': wait_for [] → "
            '["process perception running within 30 s"] (system.yaml:6 → edited.yaml:6); '
            'wait_for counts from its next start'
        ],
    ),
    'the container with all of them': (
        "'9'",
        "'8'",
        [
            "± process 'perception': command "
            '["sleep", "9"] → ["sleep", "8"] (system.yaml:4 → edited.yaml:4); '
            'a process takes this when it starts; lost: the running process'
        ],
    ),
}


@pytest.mark.parametrize('name', EDITS)
def test_an_edit_of_a_container_is_told(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    old, new, told = EDITS[name]
    (tmp_path / 'values.yaml').write_text('/**: {ros__parameters: {size: 1}}')
    (tmp_path / 'system.yaml').write_text(SYSTEM)
    (tmp_path / 'edited.yaml').write_text(SYSTEM.replace(old, new))
    run(['plan', 'system.yaml', 'edited.yaml'])
    assert capsys.readouterr().out.splitlines()[:-1] == told
