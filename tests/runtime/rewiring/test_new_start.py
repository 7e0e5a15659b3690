"""What ROS reads once in a process starts the whole system again, in the same process."""

import os
import signal
import socket
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from tests.running import ROOT

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
environment: {MODE: first}
executor: {shutdown_timeout: 1}
nodes:
  talker:
    parameters: {shell: "{{ env('MODE', 'unset') }}"}
    timers: {say: {period: 0.1, behaviour: parts:say}}
    on_start: parts:start
    on_stop: parts:stop
processes:
  child: {command: [sh, -c, 'echo child has $MODE; exec sleep 1000']}
"""
CODE = """\
import atexit
import os
import time

HANGS = False

def say(node):
    descriptors = len(os.listdir('/proc/self/fd'))
    mode = os.environ['MODE']
    node.logger.info(f'{mode} in {os.getpid()}, {descriptors} descriptors')

def start(node):
    if os.environ['MODE'] == 'bad':
        raise OSError('no such device')
    # A new start knows nothing of it.
    os.environ['MORE'] = os.environ.get('MORE', '') + '+'
    node.logger.info(f'more is {os.environ["MORE"]}, shell is {node.parameters.shell}')

def stop(node):
    node.logger.info('stopping')
    time.sleep(1000 if HANGS else 0.3)

atexit.register(lambda: print('at exit', flush=True))
"""


@pytest.fixture
def edit(compose):
    def change(old, new, name='system.yaml'):
        path = compose.folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return change


def test_a_new_environment_starts_the_system_again(compose, edit, monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind('')
        monkeypatch.setenv('NOTIFY_SOCKET', f'@{systemd.getsockname()[1:].decode()}')
        child = compose(SYSTEM, CODE, '--watch')
        child.wait_for_line(f'first in {child.pid}')
        # It is read as it was first, whatever variables the system has set.
        edit('period: 0.1', 'period: 0.2')
        assert child.wait_for_line('reloaded in').endswith(': ~1 timer')

        edit('MODE: first', 'MODE: second')
        child.wait_for_line(f'second in {child.pid}', times=10)
        told = [systemd.recv(1000).split(b'\n')[0] for _ in range(3)]
    assert told == [b'READY=1', b'RELOADING=1', b'READY=1']
    because = 'because of environment.MODE'
    assert child.wait_for_line('must start again').endswith(f'{because}; rehearsing')
    child.wait_for_line('the system starts again: ±1 system')
    child.wait_for_line('child has second')
    first, second = (
        max(int(line.split()[-2]) for line in child.matching(f'{mode} in'))
        for mode in ('first', 'second')
    )
    assert second <= first
    assert len(child.matching('more is +, shell is unset')) == 2
    assert len(child.matching('stopping')) == len(child.matching('at exit')) == 1
    assert child.stop() == 0
    assert not child.matching('outlived')


def test_what_cannot_start_again_runs_on(compose, edit):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    edit('HANGS = False', "HANGS = 1 // (os.environ['MODE'] == 'first')", 'parts.py')
    child.wait_for_line('reloaded in')
    edit('MODE: first', 'MODE: second')
    child.wait_for_line('not reloaded: ')
    assert child.matching('error[broken-behaviour]')
    child.wait_for_line('first in', times=len(child.matching('first in')) + 3)
    assert len(child.matching(' ready in ')) == 1
    assert not child.matching('at exit')


@pytest.mark.parametrize(
    ('number', 'line', 'codes'),
    [
        (signal.SIGINT, 'stopping', [0]),
        (signal.SIGKILL, 'stopping', [-signal.SIGKILL]),
        # The middleware leaves the graph then, with the interpreter held; or that is over.
        (signal.SIGHUP, 'at exit', [0, -signal.SIGHUP]),
    ],
)
def test_a_signal_ends_it_for_good(compose, edit, number, line, codes):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    edit('MODE: first', 'MODE: second')
    child.wait_for_line(line)
    assert child.stop(number) in codes
    assert len(child.matching(' ready in ')) == 1


def test_what_hangs_is_left_behind(compose, edit):
    child = compose(SYSTEM, CODE.replace('HANGS = False', 'HANGS = True'), '--watch')
    child.wait_until_ready()
    edit('MODE: first', 'MODE: second')
    child.wait_for_line('second in')
    assert child.matching("node 'talker': on_stop did not end in time; it is at")
    assert not child.matching('at exit')
    child.send(signal.SIGKILL)


def test_a_new_start_that_fails_ends_it(compose, edit):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    edit('MODE: first', 'MODE: bad')
    assert child.wait() == 1
    assert child.matching('on_start raised OSError')


def test_who_asks_is_answered_before(compose, edit, capfd, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', str(compose.folder / 'log'))
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    edit('MODE: first', 'MODE: second')
    assert run(['reload']) == 0
    assert capfd.readouterr().out == 'system: the system starts again: ±1 system\n'
    child.wait_for_line('second in')
    assert run(['reload']) == 0
    assert capfd.readouterr().out == 'system: nothing has changed\n'
    assert run(['down']) == 0
    assert child.wait() == 0


def test_a_program_of_the_user_is_not_started_again(compose, edit, capfd, monkeypatch):
    path = compose.write(SYSTEM, CODE)
    program = subprocess.Popen(
        [sys.executable, '-c', f'import composer; composer.up({path.name!r})'],
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(compose.folder)},
        stderr=subprocess.PIPE,
        text=True,
    )
    monkeypatch.setenv('ROS_LOG_DIR', str(compose.folder / 'log'))
    with program:
        next(line for line in program.stderr if ' ready in ' in line)
        edit('MODE: first', 'MODE: second')
        assert run(['reload']) == 1
        assert capfd.readouterr().err == (
            'system: not reloaded: environment.MODE cannot change while the system runs: ROS reads this when '
            'it starts\n'
        )
        assert run(['down']) == 0


def test_interface_packages_come_and_change(compose, edit, shared_cache, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    definition = compose.folder / 'defs' / 'msg' / 'Spot.msg'
    definition.parent.mkdir(parents=True)
    definition.write_text('int32 x\n')
    child = compose(
        'version: 1\nnodes:\n  one: {}\n',
        'def say(node):\n'
        '    from new_defs.msg import Spot\n'
        '    node.logger.info(f"fields {list(Spot.get_fields_and_field_types())}")\n',
        '--watch',
    )
    child.wait_until_ready()
    edit(
        'nodes:\n',
        'interfaces: {new_defs: defs}\nnodes:\n'
        '  spots:\n'
        '    publishers: {spot: {type: new_defs/msg/Spot, external: true}}\n'
        '    timers: {say: {period: 0.1, behaviour: parts:say}}\n',
    )
    child.wait_for_line("fields ['x']")
    assert child.matching('reloaded in')[0].endswith(': +1 node')

    definition.write_text('int32 x\nint 32\n')
    child.wait_for_line('not reloaded')
    child.wait_for_line("fields ['x']", times=len(child.matching('fields')) + 2)
    definition.write_text('int32 x\nfloat64 y\n')
    child.wait_for_line("fields ['x', 'y']")
    assert child.wait_for_line('must start again').endswith(
        'because of interfaces.new_defs; rehearsing'
    )
    assert child.stop() == 0
