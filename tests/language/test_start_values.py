"""Values that are read when the system starts: what a command prints, and what files hold."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.cli.showing.show import final_data
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.language.values.start_reader import StartValueReader

HEAD = 'version: 1\nnodes: {n: {}}\n'
LIMITS = """
arm: {joints: [shoulder, elbow], most: 3, fast: true, name: left, speed: 2}
/**: {ros__parameters: {a.b: 1.5}}
nothing:
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / 'limits.yaml').write_text(LIMITS)
    (tmp_path / 'arm.urdf').write_text('<robot/>\n')
    (tmp_path / 'empty.txt').write_text('\n')
    # What a command runs in is the current folder; files are beside the system.
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return tmp_path


def load(folder, text, words=(), reader=None):
    path = folder / 'system.yaml'
    path.write_text(text)
    return load_system(path, words, read_value=(reader or StartValueReader()).read)


def parameter(folder, text, reader=None):
    system = load(
        folder, f'version: 1\nnodes: {{n: {{parameters: {{p: {text}}}}}}}\n', reader=reader
    )
    assert system.diagnostics == []
    spec = system.spec.nodes['n'].parameters['p']
    return spec.type, spec.value


@pytest.mark.parametrize(
    ('source', 'expected'),
    [
        ('{command: [printf, "a b\\n"]}', ('string', 'a b\n')),
        ('{command: [echo, 7], type: double, maximum: 9.0}', ('double', 7.0)),
        ('{command: [echo, "[1, 2]"], type: double_array}', ('double_array', [1.0, 2.0])),
        ('{command: [echo, true], type: bool}', ('bool', True)),
        ('{file: arm.urdf}', ('string', '<robot/>\n')),
        (
            '{file: limits.yaml, key: arm.joints, type: string_array}',
            ('string_array', ['shoulder', 'elbow']),
        ),
        ('{file: limits.yaml, key: /**.ros__parameters.a.b, type: double}', ('double', 1.5)),
    ],
)
def test_a_parameter_has_the_value_of_its_command_or_file(folder, source, expected):
    assert parameter(folder, source) == expected


@pytest.mark.parametrize(
    ('source', 'message', 'advice'),
    [
        (
            '{command: [sh, -c, "echo first >&2; echo last >&2; exit 3"]}',
            "'sh' has ended with exit code 3",
            'first\nlast',
        ),
        ('{command: [sleep, 60], timeout: 0.1}', "'sleep' has not ended after 0.1 s", 'timeout'),
        ('{command: [no_such_program]}', "there is no program 'no_such_program' on the PATH", ''),
        ('{command: [echo, fast], type: integer}', "expected an integer, got 'fast'", 'integer'),
        ('{command: ["yes"]}', 'it prints more than 10,000,000 bytes', ''),
        ('{file: empty.txt}', 'the file holds nothing', ''),
        ('{file: arm.urd}', "there is no file '{folder}/arm.urd'", ''),
        (
            '{file: limits.yaml, key: arm.joint, type: string_array}',
            "'{folder}/limits.yaml' has no key 'arm.joint'",
            'joints',
        ),
        ('{file: ../elsewhere}', 'elsewhere', ''),
    ],
)
def test_what_cannot_be_read_keeps_the_system_from_starting(folder, source, message, advice):
    with pytest.raises(ComposerError) as caught:
        parameter(folder, source)
    begin = f"{folder}/system.yaml:2:29: parameter 'p' of node 'n': "
    assert str(caught.value).startswith(begin)
    assert message.format(folder=folder) in str(caught.value)
    assert advice in (caught.value.help or '')


def test_a_command_that_is_too_slow_ends_with_all_that_it_started(folder, wait_for):
    with pytest.raises(ComposerError):
        parameter(folder, '{command: [sh, -c, "sleep 60 & echo $! > child; wait"], timeout: 0.5}')
    child = int(Path('child').read_text())
    state = Path(f'/proc/{child}/stat')
    wait_for(
        lambda: not state.exists() or state.read_text().split()[2] == 'Z', 'the child is killed'
    )


def test_arguments_variables_and_processes_take_such_values(folder):
    text = """
version: 1
args:
  host: {command: [echo, "robot{{ number }}"]}
  number: 3
  most: {file: limits.yaml, key: arm.most, type: integer, choices: [2, 3]}
vars: {twice: "{{ most * 2 }}"}
environment: {HOST: {command: [echo, "{{ host }}"]}, MOST: {file: limits.yaml, key: arm.most}}
nodes: {n: {state: {host: "{{ host }}_base", twice: "{{ twice }}"}}}
processes:
  p:
    command: [env]
    env: {URDF: {file: arm.urdf}, FAST: {file: limits.yaml, key: arm.fast}}
    parameters:
      urdf: {file: arm.urdf}
      inner: {joints: {file: limits.yaml, key: arm.joints}, command: yes, file: {a: b}}
      count: {command: [echo, 7], type: integer}
"""
    system = load(folder, text)
    assert system.diagnostics == []
    spec = system.spec
    assert dict(spec.environment) == {'HOST': 'robot3', 'MOST': '3'}
    assert dict(spec.nodes['n'].state) == {'host': 'robot3_base', 'twice': 6}
    process = spec.processes['p']
    assert dict(process.env) == {'URDF': '<robot/>', 'FAST': 'true'}
    assert dict(process.parameters) == {
        'urdf': '<robot/>\n',
        'inner': {'joints': ['shoulder', 'elbow'], 'command': 'yes', 'file': {'a': 'b'}},
        'count': 7,
    }
    # The final system runs as well from any folder, with the values of the arguments in it.
    shown = final_data(system)
    assert shown['processes']['p']['env']['URDF'] == {'file': f'{folder}/arm.urdf'}
    assert shown['environment']['HOST'] == {'command': ['echo', 'robot3']}
    with pytest.raises(ComposerError, match=r"argument 'most': .*limits\.yaml' has no key"):
        load(folder, text.replace('key: arm.most, type', 'key: arm.mst, type'))
    with pytest.raises(ComposerError, match=r"'most': 3 is not one of 1, 2"):
        load(folder, text.replace('[2, 3]', '[1, 2]'))
    # What is given needs no command.
    assert load(folder, text, ['host:=here']).spec.environment['HOST'] == 'here'


def test_a_check_runs_nothing_and_says_what_is_not_there(folder):
    text = """
version: 1
args: {a: {command: [touch, run_by_check]}, n: {command: [touch, run_by_check], type: integer}}
nodes:
  n:
    parameters:
      a: {command: [touch, run_by_check], type: integer, minimum: 5, maximum: 9}
      b: {file: arm.urd}
      c: {command: [no_such_program, "/no/such/file.xacro"]}
      d: "{{ n + 1 }}"
      e: {file: limits.yaml, key: arm.joints, type: double_array}
  out:
    when: false
    parameters: {c: {command: [no_such_program]}}
environment: {ROS_DOMAIN_ID: {command: [touch, run_by_check]}}
"""
    path = folder / 'system.yaml'
    path.write_text(text)
    found = check_system(load_system(path), InterfaceCatalogue())
    told = [(each.rule, each.span.line, each.span.column) for each in found]
    assert told == [('missing-file', 8, 17), ('missing-program', 9, 21), ('missing-file', 9, 38)]
    subprocess.run([sys.executable, '-m', 'composer', 'check', str(path)], check=False)
    assert not Path('run_by_check').exists()


@pytest.mark.parametrize(
    ('source', 'rule', 'text'),
    [
        ('{command: [a], default: 1}', 'conflicting-keys', 'default'),
        ('{command: [a], file: b}', 'conflicting-keys', 'file'),
        ('{command: a}', 'wrong-type', 'a'),
        ('{command: []}', 'out-of-range', '['),
        ('{file: a, timeout: 1}', 'missing-key', 'timeout'),
        ('{command: [a], timeout: 0}', 'out-of-range', '0'),
    ],
)
def test_a_source_in_another_form_is_a_finding(folder, source, rule, text):
    path = folder / 'system.yaml'
    for form in ('nodes: {{n: {{parameters: {{p: {}}}}}}}', 'args: {{p: {}}}\nnodes: {{}}'):
        path.write_text(f'version: 1\n{form.format(source)}\n')
        found = load_system(path).diagnostics
        assert [(each.rule, each.span.text) for each in found] == [(rule, text)]


def test_a_command_runs_again_when_its_words_or_a_file_among_them_change(folder):
    reader = StartValueReader()
    script = folder / 'count.sh'
    script.write_text('echo run >> runs; wc -l < runs')

    def value(word=''):
        source = f'{{command: [sh, {script}, "{word}"], type: integer}}'
        return parameter(folder, source, reader)[1]

    assert [value(), value(), value('other'), value()] == [1, 1, 2, 1]
    script.write_text('echo run >> runs; echo 10')
    os.utime(script, (1, 1))
    assert [value(), value()] == [10, 10]
