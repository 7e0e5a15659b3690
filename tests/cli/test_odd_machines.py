"""Machines, and those who start Composer, that lack or forbid what others allow."""

import os
import signal
import subprocess
import sys

import pytest

from tests.running import DEADLINE_SEC, ROOT, reserved_domain

pytestmark = pytest.mark.ros

# The main program, with what comes before it.
PROGRAM = '{before}\nfrom composer.__main__ import main\nmain()'
NODES = 'nodes: {greeter: {timers: {greet: {period: 0.5, behaviour: "parts:greet"}}}}'
FILES = {
    'parts.py': 'def greet(node):\n    node.logger.info("hello")\n',
    'system.yaml': f'version: 1\n{NODES}\n',
    'process.yaml': f'version: 1\n{NODES}\n'
    'processes: {sleeper: {command: [sh, -c, "exit 7"], on_exit: shutdown}}\n',
    'worker.yaml': f'version: 1\ndefaults: {{worker: w}}\n{NODES}\n',
    'some.scenario.yaml': 'version: 1\nsystem: {file: system.yaml}\nuntil: 1.8\n'
    'cases: {it greets: {then: [{log: greeter, text: hello, count: 3}]}}\n',
}


@pytest.fixture
def run(tmp_path):
    """Run a command line of Composer; return its exit code and what it printed."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)

    def run(command, before='', prefix=(), **options):
        with reserved_domain() as domain:
            result = subprocess.run(
                [*prefix, sys.executable, '-c', PROGRAM.format(before=before), *command.split()],
                cwd=tmp_path,
                env=os.environ
                | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(tmp_path)}
                | {'ROS_DOMAIN_ID': str(domain)},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=DEADLINE_SEC,
                check=False,
                **options,
            )
        assert 'Traceback' not in result.stdout
        return result.returncode, result.stdout

    return run


def test_a_launcher_that_ignores_its_children_changes_nothing(run):
    def ignore():
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)

    code, output = run('test some.scenario.yaml', preexec_fn=ignore)
    assert code == 0, output
    code, output = run('up process.yaml', preexec_fn=ignore)
    assert code == 1, output
    assert "process 'sleeper' has ended with exit code 7, so the system ends" in output
