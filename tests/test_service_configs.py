"""Each shipped system with services or actions against plain rclpy peers in other processes."""

import json
import os
import subprocess
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parent.parent
SUCCEEDED, CANCELED = 4, 5
WAITING = 'service not available, waiting again...'
# A server may be seen a moment before it knows the way back: its first answer is lost then.
ASKING_AGAIN = 'no answer, asking again...'


@pytest.fixture(autouse=True)
def _built(interface_cache):
    """Build the packages once, for all tests of the session."""


@pytest.fixture
def up(compose):
    """Run a shipped system from the project's root."""

    def run(name, *arguments):
        return compose.run(f'configs/{name}.yaml', *arguments, folder=ROOT)

    return run


@pytest.fixture
def start_peers(domain_id, start_program):
    """Start plain rclpy peers in a process of their own, which is gone when the test ends."""

    def start(*arguments, **options):
        return start_program(
            ROOT / 'tests' / 'external_peers.py',
            *arguments,
            env=os.environ | {'PYTHONPATH': str(ROOT)},
            **options,
        )

    return start


def said_by(child, node):
    """Return what behaviours of a node have logged, without what the first line begins with."""
    prefix = f'[INFO] [{node}]: '
    said = [line.removeprefix(prefix) for line in child.matching(prefix)]
    # After a second Composer says what a client waits for.
    return [line for line in said if not (line.startswith('Waiting for ') and line.endswith('…'))]


def test_servers_answer_external_clients(up, start_peers):
    adding, counting, calculating = (
        up(f'{name}_server') for name in ('add_two_ints', 'fibonacci', 'calculator')
    )
    for child in (adding, counting, calculating):
        child.wait_until_ready()
    calls = [
        ('ask_for_sum', 'add_two_ints', -7, 2**40),
        ('send_goal', 3),
        ('send_goal', 40, 'cancel'),
        ('set_operation', 'subtract'),
        ('ask_for_sum', 'calculate', 10, 5),
        ('set_operation', 'multiply'),
    ]
    client = start_peers('ask', json.dumps(calls))
    output, _ = client.communicate(timeout=200)
    assert client.returncode == 0, output
    (line,) = (line for line in output.splitlines() if line.startswith('result '))
    total, done, canceled, changed, difference, refused = json.loads(line.removeprefix('result '))

    assert total == 2**40 - 7
    # Lines after the first are indented, so that none looks like a log message of its own.
    start = adding.lines.index('[INFO] [minimal_service]: Incoming request')
    assert adding.lines[start : start + 3] == [
        '[INFO] [minimal_service]: Incoming request',
        '  a: -7 b: 1099511627776',
        '[INFO] [minimal_service]: Sending back response: [1099511627769]',
    ]

    assert done == {
        'accepted': True,
        'feedback': [[0, 1, 1], [0, 1, 1, 2]],
        'status': SUCCEEDED,
        'sequence': [0, 1, 1, 2],
    }
    assert said_by(counting, 'fibonacci_action_server')[:3] == [
        'Executing goal...',
        'Feedback: [0, 1, 1]',
        'Feedback: [0, 1, 1, 2]',
    ]
    assert canceled['status'] == CANCELED
    assert len(canceled['feedback']) < 38

    assert changed == [True, '']
    assert difference == 5
    accepted, reason = refused
    assert not accepted
    assert 'add' in reason
    assert 'subtract' in reason
    client = up('calculator_client', '10', '4', 'subtract')
    assert client.wait() == 0
    assert said_by(client, 'calculator_client') == ['Result: 6']
    assert said_by(calculating, 'calculator_server') == ['10 - 5 = 5', '10 - 4 = 6']
    for child in (adding, counting, calculating):
        assert child.stop() == 0


def test_clients_wait_for_external_servers_and_end(up, start_peers):
    child = up('add_two_ints_client', 'b:=-3', '-4')
    child.wait_for_line(f'[INFO] [minimal_client_async]: {WAITING}')
    server = start_peers('serve', stdin=subprocess.PIPE)
    assert 'ready\n' in iter(server.stdout.readline, ''), 'the external peer did not start'
    assert child.wait() == 0
    said = said_by(child, 'minimal_client_async')
    assert said[-1] == 'Result of add_two_ints: for -4 + -3 = -7'
    assert said[0] == WAITING
    assert set(said[:-1]) <= {WAITING, ASKING_AGAIN}

    child = up('fibonacci_client')
    assert child.wait() == 0
    sequence = [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]
    said = said_by(child, 'fibonacci_action_client')
    feedback = [f'Received feedback: {sequence[:n]}' for n in range(3, 12)]
    # An external server need not wait for the goal's answer before its first feedback.
    assert sorted(said[:-1]) == sorted(['Goal accepted :)', *feedback])
    assert [line for line in said if line in feedback] == feedback
    assert said[-1] == f'Result: {sequence}'
    child = up('fibonacci_client')
    assert child.wait() == 1
    assert said_by(child, 'fibonacci_action_client') == ['Goal rejected :(']

    # The server is set, and then taken as it is.
    for words in (['10', '5', 'subtract'], ['10', '5']):
        child = up('calculator_client', *words)
        assert child.wait() == 0, child.output
        assert said_by(child, 'calculator_client')[-1] == 'Result: 5'


def test_self_contained_ends_by_itself_with_the_right_numbers(up):
    child = up('self_contained')

    assert child.wait() == 0
    assert said_by(child, 'clients') == [
        '2 + 3 = 5',
        'feedback: [0, 1, 1]',
        'feedback: [0, 1, 1, 2]',
        'feedback: [0, 1, 1, 2, 3]',
        'feedback: [0, 1, 1, 2, 3, 5]',
        'succeeded: [0, 1, 1, 2, 3, 5]',
    ]
    assert 'Sending back response: [5]' in said_by(child, 'servers')
