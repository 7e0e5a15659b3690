"""The system has no errors and works. It runs with real nodes, as with `composer up`."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
COMPOSER = [sys.executable, '-m', 'composer']
DEADLINE_SEC = 30.0


def test_it_has_no_errors():
    done = subprocess.run(
        [*COMPOSER, 'check', '--strict', 'configs'], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def system():
    """Run the system until the test ends, in a ROS domain of its own if none is set."""
    with subprocess.Popen(
        [*COMPOSER, 'up', 'configs/my_system.yaml', 'who:=Alice'],
        cwd=ROOT,
        env={'ROS_DOMAIN_ID': str(1 + os.getpid() % 100), **os.environ},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        deadline = threading.Timer(DEADLINE_SEC, process.kill)
        deadline.start()
        yield process
        deadline.cancel()
        process.kill()


def test_the_listener_gets_the_greeting_and_the_system_stops_cleanly(system):
    output = []
    for line in system.stdout:
        output.append(line)
        if 'I heard: Hello Alice!' in line:
            break
    else:
        pytest.fail('no greeting:\n' + ''.join(output))
    system.send_signal(signal.SIGINT)
    rest = system.stdout.read()
    assert system.wait() == 0, rest
