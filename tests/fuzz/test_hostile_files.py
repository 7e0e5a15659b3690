"""No file takes a check more than seconds and 200 MB, or breaks it: what is too large is said."""

import contextlib
import os
import re
import resource
import signal
import sys
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
        with contextlib.suppress(BaseException):
            _run_in_child(folder, output, words, memory)
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
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    memory = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    code = run(list(words))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


@pytest.mark.parametrize('name', CASES)
def test_hostile_files_end_in_findings(name, tmp_path):
    write_files, rules = CASES[name]
    write_files(tmp_path)
    code, output = run_limited(tmp_path)
    assert code == (1 if 'error[' in output else 0), output[-2000:]
    assert rules <= set(re.findall(r'(?:error|warning)\[([\w-]+)\]', output))
