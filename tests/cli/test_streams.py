"""Standard streams that a shell has closed, or that take nothing, for every way to write."""

import os
import subprocess
import sys
from itertools import islice

import pytest

from tests.running import ROOT

BAD = 'composer/rules/bad-key/bad.yaml'
# Each with the exit code where all streams are open; the first three have each of these codes.
COMMANDS = {
    'check configs/greeter.yaml': 0,
    f'up {BAD}': 1,
    'unknown': 2,
    f'check --format json {BAD}': 1,
    'graph configs/greeter.yaml': 0,
    '--help': 0,
}
FULL = 'error: cannot write the output: No space left on device\n'


@pytest.fixture(scope='module')
def run_all():
    """Run commands with a redirection; return exit code and output of each."""

    def run_all(redirection, commands=COMMANDS):
        script = ''.join(
            f'"$0" -m composer {command} {redirection}; echo "=== $?"; echo "===" >&2\n'
            for command in commands
        )
        result = subprocess.run(
            ['sh', '-c', script, sys.executable],
            cwd=ROOT,
            env=os.environ | {'PYTHONPATH': str(ROOT)},
            capture_output=True,
            text=True,
            timeout=200,
            check=True,
        )
        codes = [line for line in result.stdout.splitlines() if line.startswith('=== ')]
        errors = result.stderr.split('===\n')
        assert not [text for text in errors if 'bug' in text or 'Traceback' in text]
        return [int(code.removeprefix('=== ')) for code in codes], errors[:-1]

    return run_all


@pytest.mark.parametrize('redirection', ['>&- 2>&- <&-', '2>/dev/full'])
def test_without_a_stream_the_exit_code_is_the_same(run_all, redirection):
    expected = dict(islice(COMMANDS.items(), 3))
    codes, _ = run_all(redirection, expected)
    if redirection == '2>/dev/full':
        # What is said there cannot be said.
        assert [bool(code) for code in codes] == [bool(code) for code in expected.values()]
    else:
        assert codes == list(expected.values())


def test_a_full_standard_output_is_an_ordinary_error(run_all):
    codes, errors = run_all('>/dev/full')
    written = [command not in (f'up {BAD}', 'unknown') for command in COMMANDS]
    assert codes == [2 if command == 'unknown' else 1 for command in COMMANDS]
    assert [FULL in error for error in errors] == written


def end_without_reader(words, folder, **variables):
    """Run a command whose output nobody reads; return its exit code."""
    reader, writer = os.pipe()
    os.close(reader)
    ended = subprocess.run(
        [sys.executable, '-m', 'composer', *words],
        cwd=folder,
        env=os.environ | variables,
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
        check=False,
    )
    os.close(writer)
    for text in ('Broken pipe', 'Traceback', 'bug', 'cannot write'):
        assert text not in ended.stderr
    return ended.returncode


@pytest.mark.parametrize(
    ('words', 'code'),
    [
        ('check bad.yaml', 1),
        ('plan good.yaml other.yaml --exit-code', 2),
    ],
)
def test_a_reader_that_has_gone_changes_no_exit_code(tmp_path, words, code):
    (tmp_path / 'good.yaml').write_text('version: 1\nnodes: {n: {}}\n')
    (tmp_path / 'other.yaml').write_text('version: 1\nnodes: {m: {}}\n')
    (tmp_path / 'bad.yaml').write_text('version: 1\nnodes: {n: {x: 1}}\n')
    assert end_without_reader(words.split(), tmp_path) == code


@pytest.mark.ros
def test_a_command_that_goes_on_ends_when_its_reader_has_gone(compose):
    system = 'timers: {tick: {period: 0.1, behaviour: parts:tick}}'
    child = compose(f'version: 1\nnodes: {{n: {{{system}}}}}\n', 'def tick(node): print(1)\n')
    child.wait_until_ready()
    domain = {'ROS_DOMAIN_ID': str(compose.domain_id)}
    assert end_without_reader(['top'], compose.folder, **domain) == 0
    assert child.stop() == 0
