"""`composer.up()` called by a program, once or again and again."""

import json
import os
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from pathlib import Path

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]

SYSTEM = """
version: 1
nodes:
  talker:
    publishers: {ticks: std_msgs/msg/Int32}
    timers:
      tick: {period: 0.01, publish: ticks, message: 1}
  listener:
    state: {heard: 0}
    parameters: {enough: 3}
    subscriptions: {ticks: {type: std_msgs/msg/Int32, behaviour: 'parts:hear'}}
    on_stop: parts:look
"""

CODE = """
import os
import re

def hear(node, message):
    node.state.heard += 1
    if node.state.heard == node.parameters.enough:
        node.shutdown(0)

# Fast DDS names the memory of a participant by chance, and that of a port by its number. What is
# there before belongs to others, be it that they were killed.
port = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
ports = '|'.join(f'port{number}' for number in range(port, port + 250))
own = re.compile(f'/dev/shm/(?:sem[.])?fast(?:rtps|dds)_(?:[0-9a-f]{{16}}|{ports})(?:_el|_mutex)?')
before = {f'/dev/shm/{name}' for name in os.listdir('/dev/shm')}
files = set()

def look(node):
    # What is shared between processes is mapped into this one as long as the system lives.
    with open('/proc/self/maps') as maps:
        names = {line.split()[-1] for line in maps}
    files.update(name for name in names - before if own.fullmatch(name))
"""

# What a program in trouble may do: call `up` many times, in this thread and in others.
PROGRAM = """
import json, os, signal, sys, threading, time
import composer

handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
path = list(sys.path)
codes = []
for turn in range(int(sys.argv[2])):
    if turn % 2:
        thread = threading.Thread(target=lambda: codes.append(composer.up(sys.argv[1])))
        thread.start()
        thread.join()
    else:
        codes.append(composer.up(sys.argv[1]))
    if turn == 0:
        before = [len(os.listdir(f'/proc/self/{kind}')) for kind in ('task', 'fd')]
# A thread that has been joined may take a moment to leave the kernel's list.
deadline = time.monotonic() + 20
new = [1]
while any(new) and time.monotonic() < deadline:
    time.sleep(0.01)
    after = [len(os.listdir(f'/proc/self/{kind}')) for kind in ('task', 'fd')]
    new = [max(0, now - then) for now, then in zip(after, before)]
import parts
print(json.dumps({
    'codes': codes,
    'threads': [thread.name for thread in threading.enumerate()],
    'new tasks and descriptors': new,
    'seen': len(parts.files),
    'left': [name for name in parts.files if os.path.exists(name)],
    'handlers': handlers == [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)],
    'path': path == sys.path,
}))
"""


@pytest.fixture
def run_program(compose):
    """Run Python code in a process of its own, beside a system; return what it prints."""

    def run(code, *arguments):
        result = subprocess.run(
            [sys.executable, '-c', code, *map(str, arguments)],
            cwd=compose.folder,
            env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(compose.folder)},
            stdout=subprocess.PIPE,
            text=True,
            timeout=200,
            check=False,
        )
        assert result.returncode == 0, result.stdout
        return result.stdout

    return run


@pytest.mark.usefixtures('shared_memory')
def test_many_systems_in_a_row_leave_nothing_behind(compose, run_program):
    path = compose.write(SYSTEM, CODE)
    result = json.loads(run_program(PROGRAM, path.name, 4))

    assert result['seen'] > 0, 'a middleware that shares no memory'
    assert result == {
        'codes': [0] * 4,
        'threads': ['MainThread'],
        'new tasks and descriptors': [0, 0],
        'seen': result['seen'],
        'left': [],
        'handlers': True,
        'path': True,
    }


def test_all_is_as_before_when_a_system_has_ended_that_had_arguments(compose, run_program):
    text = SYSTEM.replace('  talker:\n', '  talker:\n    log_level: error\n')
    text = text.replace('parts:look', 'parts:tell').replace(
        'nodes:\n',
        'environment: {MODE: fast, RCUTILS_CONSOLE_OUTPUT_FORMAT: "{message}"}\nnodes:\n',
    )
    tell = 'def tell(node):\n    print(node.state.heard, os.environ["MODE"])\n'
    path = compose.write(text, f'{CODE}\n{tell}')
    program = """
import os, sys
import composer
from rclpy.logging import get_logger_level, set_logger_level, LoggingSeverity

os.environ['MODE'] = 'slow'
os.environ.pop('RCUTILS_CONSOLE_OUTPUT_FORMAT', None)
before = dict(os.environ)
set_logger_level('listener', LoggingSeverity.WARN)
arguments = ['-p', 'listener:enough:=5']
code = composer.up(sys.argv[1], log_levels=['listener:=debug'], ros_arguments=arguments)
levels = [get_logger_level(name).name for name in ('talker', 'listener')]
print(code, *levels, before == dict(os.environ))
"""
    heard, mode, *after = run_program(program, path.name).split()

    assert int(heard) >= 5
    assert mode == 'fast'
    assert after == ['0', 'UNSET', 'WARN', 'True']


def test_two_systems_run_at_the_same_time_in_one_process(compose, run_program):
    path = compose.write(SYSTEM, CODE)
    second = compose.folder / 'second.yaml'
    second.write_text(path.read_text().replace('ticks', 'tocks'))
    program = """
import sys, threading
import composer

codes = []
threads = [
    threading.Thread(target=lambda name=name: codes.append(composer.up(name)))
    for name in sys.argv[1:]
]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(codes)
"""

    assert run_program(program, path.name, second.name) == '[0, 0]\n'
