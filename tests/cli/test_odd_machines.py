"""Machines, and those who start Composer, that lack or forbid what others allow."""

import os
import re
import resource
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


REFUSED = 'def refuse(*_):\n    raise OSError(38, "Function not implemented")\n'
LACKS = {
    'pidfd_open': 'import os; os.pidfd_open = refuse',
    'eventfd': 'import os; os.eventfd = refuse',
    'epoll': 'import select; select.epoll = refuse',
}


@pytest.mark.parametrize(
    ('call', 'command'),
    [('pidfd_open', 'up worker.yaml'), ('epoll', 'test some.scenario.yaml'), ('eventfd', 'down')],
)
def test_a_kernel_that_lacks_a_call_is_refused_in_one_line(run, call, command):
    code, output = run(command, REFUSED + LACKS[call])
    assert code == 1
    message, advice = output.splitlines()
    assert message.startswith('error: systems cannot run here without ')
    assert call in message
    assert message.endswith(': Function not implemented')
    assert 'Linux 5.3' in advice


def test_a_python_that_lacks_a_call_is_refused_in_one_line(run):
    code, output = run('up system.yaml', 'import os; del os.pidfd_open')
    assert (code, output.count('error: ')) == (1, 1)
    assert output.splitlines()[0].endswith(': this Python lacks it')


def test_too_few_threads_are_refused_before_the_start(run):
    """Each stack takes a gigabyte, of eight that the process may have."""
    before = 'import threading\nthreading.stack_size(1 << 30)'
    limits = (8 << 30, 8 << 30)
    code, output = run(
        'up worker.yaml', before, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limits)
    )
    message, advice = output.splitlines()
    assert code == 1
    assert re.fullmatch(r'error: \d+ more threads are needed, and only \d can be started', message)
    assert '--pids-limit' in advice


def test_a_machine_without_temporary_folder_is_told_in_one_line(run):
    """As in a container whose root is read-only."""
    before = 'import tempfile\ntempfile._candidate_tempdir_list = lambda: ["/proc/none"]'
    code, output = run('up process.yaml', before)
    errors = [line for line in output.splitlines() if 'error: ' in line]
    assert (code, len(errors)) == (1, 1), output
    assert re.search('No usable temporary directory|no folder for temporary files', errors[0])


NO_PROC = 'mount -t tmpfs none /proc && exec "$@"'
LACKING = {
    '/proc: ': (['unshare', '-r', '-m', 'sh', '-c', NO_PROC, 'sh'], ''),
    'the loopback interface is down': (['unshare', '-r', '-n'], ''),
    'timerfd_create: ': ([], 'import ctypes; ctypes.CDLL.timerfd_create = lambda *_: -1'),
}


@pytest.mark.usefixtures('shared_memory')
@pytest.mark.parametrize('lacking', LACKING)
def test_what_else_a_machine_lacks_is_told_in_one_line(run, lacking):
    prefix, before = LACKING[lacking]
    if prefix and subprocess.run([*prefix, 'true'], check=False, capture_output=True).returncode:
        pytest.skip('this machine allows no namespaces')
    code, output = run('up worker.yaml', before, prefix)
    assert (code, output.count('error: ')) == (1, 1), output
    assert lacking in output.partition('error: ')[2].splitlines()[0]


def test_a_module_that_replaces_threads_is_refused(run, tmp_path):
    """As gevent's `monkey.patch_all` does."""
    with (tmp_path / 'parts.py').open('a') as parts:
        parts.write('import _thread; _thread.start_new_thread = lambda *_: 0')
    code, output = run('up worker.yaml')
    assert code == 1
    assert "error[broken-behaviour]: importing 'parts' replaced the threads of Python" in output
    assert 'help: leave out monkey.patch_all() of gevent or eventlet' in output
