"""`composer check`: its options, what it says where, and what it ends with."""

import io
import json
import os
import pty
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import composer
from composer.cli import main as cli

ROOT = Path(composer.__file__).parents[1]
RIGHT = 'version: 1\nnodes: {rover: {}}\n'
FAULTY = 'version: 1\nnodes: {1st: {log_level: loud}}\n'
WARNED = 'version: 1\nnodes: {}  # composer: ignore[bad-name]\n'


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Return exit code, standard output and standard error of a check in an own folder."""
    monkeypatch.chdir(tmp_path)
    for name, text in (('right', RIGHT), ('invalid', FAULTY), ('warned', WARNED)):
        (tmp_path / f'{name}.yaml').write_text(text)

    def run(*arguments):
        code = cli.run(['check', *map(str, arguments)])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def feed(monkeypatch, content):
    monkeypatch.setattr(sys, 'stdin', io.TextIOWrapper(io.BytesIO(content)))


# What is checked


def test_all_errors_of_all_files_are_found_in_one_run(run):
    code, out, err = run('invalid.yaml', 'right.yaml', 'missing.yaml', '*.yml', 'nowhere*')
    assert code == 1
    assert 'invalid.yaml:2:9: error[bad-name]: ' in out
    assert 'invalid.yaml:2:26: error[bad-value]: ' in out
    assert 'missing.yaml: error[unreadable-file]: ' in out
    assert '*.yml: error[nothing-to-check]: no file matches this pattern' in out
    assert 'right.yaml: ok, 1 node\n' in out
    assert err == '5 errors in 4 files\n'


def test_a_folder_is_searched(run):
    code, out, _ = run('.', '-q')
    assert code == 1
    assert {line.partition(':')[0] for line in out.splitlines() if 'error[' in line} == {
        'invalid.yaml'
    }


def test_standard_input_is_a_file(run, monkeypatch):
    feed(monkeypatch, RIGHT.encode())
    assert run('-') == (0, '<stdin>: ok, 1 node\n', '')


def test_standard_input_is_called_as_it_is_told(run, monkeypatch, tmp_path):
    (tmp_path / 'robots').mkdir()
    (tmp_path / 'robots' / 'driving.py').write_text('def start(node): ...\n')
    feed(monkeypatch, b'version: 1\nnodes: {rover: {on_start: driving:strt}}\n')
    code, out, _ = run('-', '--stdin-filename', 'robots/rover.yaml')
    assert code == 1
    assert out.startswith('robots/rover.yaml:2:35: error[unknown-behaviour]: ')
    assert "did you mean 'start'?" in out


@pytest.mark.parametrize('content', [b'', b'\xff', b'a: [', b'- 1'])
def test_standard_input_may_hold_anything(run, monkeypatch, content):
    feed(monkeypatch, content)
    code, out, err = run('-')
    assert code == 1
    assert out.startswith('<stdin>')
    assert err == '1 error in 1 file\n'


def test_other_files_can_be_skipped(run, tmp_path):
    (tmp_path / 'compose.yaml').write_text('version: "3"\nservices: {}\n')
    assert run('compose.yaml', '-q')[0] == 1
    assert run('compose.yaml', '--skip-other-files') == (0, '', '')


# What is said


def test_quiet_says_what_is_wrong_and_nothing_else(run):
    assert run('right.yaml', '--quiet') == (0, '', '')
    code, out, err = run('invalid.yaml', 'right.yaml', '-q')
    assert (code, err) == (1, '')
    assert out.count('error[') == 2
    assert 'ok' not in out


@pytest.mark.parametrize('name', ['json', 'sarif', 'junit', 'github', 'text'])
def test_a_report_goes_to_standard_output(run, name):
    code, out, err = run('invalid.yaml', '--format', name)
    assert code == 1
    assert 'bad-name' in out
    assert err == '2 errors in 1 file\n'


def test_a_report_goes_to_a_file_and_text_to_the_terminal(run, tmp_path):
    code, out, err = run('invalid.yaml', '--format', 'junit', '--output', 'report.xml')
    assert (code, err) == (1, '2 errors in 1 file\n')
    assert out.startswith('invalid.yaml:2:9: error[bad-name]: ')
    assert ET.parse(tmp_path / 'report.xml').getroot().get('failures') == '1'


def test_a_report_that_cannot_be_written_is_an_error(run):
    code, _, err = run('right.yaml', '--output', 'nowhere/report.txt')
    assert code == 1
    assert (
        err == 'error: cannot write the report to nowhere/report.txt: No such file or directory\n'
    )


def test_paths_of_reports_are_relative_to_the_working_folder(run, tmp_path):
    _, out, _ = run(tmp_path / 'invalid.yaml', '--format', 'json')
    assert {finding['file'] for finding in json.loads(out)['findings']} == {'invalid.yaml'}


def test_a_machine_reads_what_was_not_checked(run, monkeypatch, tmp_path):
    monkeypatch.setenv('AMENT_PREFIX_PATH', '')
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    code, out, err = run('right.yaml', '--format', 'json')
    line = 'not checked without ROS 2: interface types and the fields of messages'
    assert (code, err) == (0, line + '\n')
    assert json.loads(out)['not_checked'] == [line]


def in_a_terminal(folder, **variables):
    """Return what a check writes to a terminal."""
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'composer', 'check', 'invalid.yaml'],
        cwd=folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'TERM': 'xterm', **variables},
        stdout=slave,
        stderr=slave,
        stdin=subprocess.DEVNULL,
    )
    os.close(slave)
    written = b''
    try:
        while chunk := os.read(master, 65536):
            written += chunk
    except OSError:
        pass  # what Linux says when nobody holds the other end any more
    finally:
        os.close(master)
        assert process.wait(60) == 1
    return written.decode()


def test_a_terminal_gets_colours(run, tmp_path):
    assert '\x1b[31m\x1b[1merror[bad-name]\x1b[0m' in in_a_terminal(tmp_path)


def test_a_terminal_that_wants_no_colours_gets_none(run, tmp_path):
    written = in_a_terminal(tmp_path, NO_COLOR='1')
    assert 'error[bad-name]' in written
    assert '\x1b' not in written


# What counts


def test_warnings_count_when_that_is_asked_for(run):
    code, out, err = run('warned.yaml')
    assert (code, err) == (0, '1 warning in 1 file\n')
    assert out.startswith('warned.yaml:2:31: warning[unused-ignore]: ')
    assert run('warned.yaml', '--strict')[0] == 1
    assert run('right.yaml', '--strict')[0] == 0


def test_ignored_rules_are_left_out(run):
    code, out, err = run('invalid.yaml', '--ignore', 'bad-name')
    assert (code, err) == (1, '1 error in 1 file\n')
    assert 'bad-name' not in out
    ignored = ('--ignore', 'bad-name', '--ignore', 'bad-value')
    assert run('invalid.yaml', *ignored) == (0, 'invalid.yaml: ok, 1 node\n', '')


def test_an_expectation_passes_if_exactly_these_rules_fire(run):
    expected = ('--expect', 'bad-name', '--expect', 'bad-value')
    code, out, err = run('invalid.yaml', *expected)
    assert code == 0
    assert out.count('error[') == 2
    assert err == '2 errors in 1 file\nas expected: bad-name, bad-value\n'
    assert run('invalid.yaml', '-q', *expected)[2] == ''


def test_an_expectation_fails_if_other_rules_fire(run):
    code, _, err = run('invalid.yaml', '--expect', 'bad-name', '--expect', 'bad-key')
    assert code == 1
    assert err.splitlines()[1:] == [
        "expected 'bad-key', which found nothing",
        "'bad-value' was not expected",
    ]
    assert run('right.yaml', '--expect', 'bad-name')[0] == 1
    assert run('warned.yaml', '--expect', 'unused-ignore')[0] == 0


@pytest.mark.parametrize('option', ['--ignore', '--expect'])
def test_an_unknown_rule_is_wrong_usage(run, option):
    code, out, err = run('invalid.yaml', option, 'bad-nam')
    assert (code, out) == (2, '')
    assert "there is no rule 'bad-nam'\n  help: did you mean 'bad-name'?" in err
    code, out, err = run('invalid.yaml', option, 'qqqqqq')
    assert code == 2
    assert "there is no rule 'qqqqqq'\n  help: 'composer explain' lists them" in err


# --import

DECORATED = """\
import functools

print('imported')

logged = eval('lambda f: functools.wraps(f)(lambda *args, **given: f(*args, **given))')

@logged
def start(node, speed): ...

@logged
def count(node):
    yield 1
"""


@pytest.fixture
def imports(run, tmp_path):
    """Check a node with behaviours of the module `driving`."""

    def imports(node, code, *options):
        (tmp_path / 'driving.py').write_text(code)
        (tmp_path / 'rover.yaml').write_text(f'version: 1\nnodes: {{rover: {node}}}\n')
        return run('rover.yaml', '--import', *options)

    return imports


def test_an_import_shows_what_the_source_does_not(run, imports, tmp_path):
    node = '{on_start: driving:start, on_stop: driving:count}'
    code, out, err = imports(node, DECORATED)
    assert code == 1
    assert 'error[bad-signature]: start(node, speed) is called as start(node): missing' in out
    # What a wrapper returns may be something else than what it wraps.
    assert 'generator-not-allowed' not in out
    assert err == 'imported\n1 error in 1 file\n'
    assert run('rover.yaml') == (0, 'rover.yaml: ok, 1 node\n', '')


def test_an_import_leaves_nothing_behind(imports):
    before = list(sys.path)
    imports('{on_start: driving:start}', DECORATED)
    assert 'driving' not in sys.modules
    assert sys.path == before
    code, out, _ = imports('{on_start: driving:start}', 'def start(node): ...\n')
    assert (code, out) == (0, 'rover.yaml: ok, 1 node\n')


@pytest.mark.parametrize('code', ['raise SystemExit(7)', '1 / 0'])
def test_an_import_that_fails_is_a_finding(imports, code):
    found, out, _ = imports('{on_start: driving:start}', f'{code}\n\ndef start(node): ...\n')
    assert found == 1
    assert "error[broken-behaviour]: importing 'driving' raised " in out


def test_an_error_is_not_found_twice(imports):
    node = '{on_start: {behaviour: driving:start, with: {sped: 1}}, on_stop: driving:stpo}'
    code, out, _ = imports(node, 'def start(node, *, speed): ...\n\ndef stop(node): ...\n', '-q')
    assert code == 1
    assert [line.split('[')[1].split(']')[0] for line in out.splitlines() if 'error[' in line] == [
        'bad-argument',
        'unknown-behaviour',
    ]


def test_a_comment_silences_what_an_import_shows(run, tmp_path):
    (tmp_path / 'driving.py').write_text(DECORATED)
    (tmp_path / 'rover.yaml').write_text(
        'version: 1\nnodes:\n  rover:\n'
        '    on_start: driving:start  # composer: ignore[bad-signature]\n'
    )
    assert run('rover.yaml', '--import')[:2] == (0, 'rover.yaml: ok, 1 node\n')
    assert run('rover.yaml')[:2] == (0, 'rover.yaml: ok, 1 node\n')


def test_without_ros_an_import_says_what_it_could_not_check(imports, monkeypatch):
    from composer.runtime.behaviours import import_check as importing

    find = importing.importlib.util.find_spec
    monkeypatch.setattr(
        importing.importlib.util, 'find_spec', lambda name: name != 'rclpy' and find(name)
    )
    code, out, err = imports(
        '{on_start: driving:start}', 'import no_such_msgs.msg\n\ndef start(node): ...\n'
    )
    assert (code, out) == (0, 'rover.yaml: ok, 1 node\n')
    assert err == 'not checked without ROS 2: what imports ROS itself (driving)\n'
