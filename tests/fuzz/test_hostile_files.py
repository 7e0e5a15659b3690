"""No file takes a check more than seconds and 200 MB, or breaks it: what is too large is said."""

import contextlib
import os
import re
import resource
import signal
import sys
import traceback
from pathlib import Path

import pytest

from composer.cli.main import run
from tests.fuzz.hostile_files import CASES

MEMORY_BYTES = 200_000_000
# Far from what any takes: only what has no end comes here.
LIMIT_SEC = 30


def run_limited(folder, words=('check', 'system.yaml'), memory=MEMORY_BYTES):
    """Run a command in a process with limits; return its code and output."""
    output = folder / 'output.txt'
    child = os.fork()
    if not child:
        try:
            _run_in_child(folder, output, words, memory)
        except BaseException:  # noqa: BLE001 - the child must not go on as pytest
            with contextlib.suppress(BaseException):
                traceback.print_exc()
                sys.stderr.flush()
        finally:
            os._exit(99)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), output.read_text(errors='replace')


def _run_in_child(folder, output, words, more):
    os.chdir(folder)
    written = os.open(output, os.O_WRONLY | os.O_CREAT)
    for number in (1, 2):
        os.dup2(written, number)
    sys.stdout, sys.stderr = open(1, 'w', closefd=False), open(2, 'w', closefd=False)  # noqa: SIM115
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    signal.alarm(LIMIT_SEC * 4)
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_SEC, LIMIT_SEC))
    # Of what can be written: an allocator reserves addresses for each thread.
    pages = int(Path('/proc/self/statm').read_text().split()[5])
    memory = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    code = run(list(words))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


@pytest.mark.sampled
@pytest.mark.parametrize('name', CASES)
def test_hostile_files_end_in_findings(name, tmp_path):
    write_files, rules = CASES[name]
    write_files(tmp_path)
    code, output = run_limited(tmp_path)
    assert code == (1 if 'error[' in output else 0), output[-2000:]
    assert rules <= set(re.findall(r'(?:error|warning)\[([\w-]+)\]', output))


LONG = {
    'include': 'include: {a: {file: %s}}',
    'parameter file': 'nodes: {a: {parameter_files: [%s]}}',
    'folder': 'processes: {a: {command: [python3, a.py], cwd: %s}}',
    'NoDL of a package': 'processes: {a: {command: [sh], interface: "package://rclpy/%s"}}',
}


@pytest.mark.parametrize('key', LONG)
def test_names_too_long_for_files_are_findings(key, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in ('x' * 300, 'd/' * 2500):
        Path('a.yaml').write_text(f'version: 1\n{LONG[key] % name}\n')
        run(['check', 'a.yaml'])
        assert 'bug in Composer' not in capsys.readouterr().err


def test_a_text_that_is_repeated_without_end_is_not_computed(tmp_path):
    (tmp_path / 'system.yaml').write_text('version: 1\nnodes: {a: {on_start: "m:f"}}\n')
    (tmp_path / 'm.py').write_text(
        'def f(node):\n    node.state.a = "a" * 10**10 + 10**10 * "b"\n'
    )
    code, output = run_limited(tmp_path)
    assert code != 3, output[-2000:]
