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


class ExternalPeers:
    """Plain rclpy peers, each in a process of its own."""

    def __init__(self, start_program):
        self._start_program = start_program

    def serve(self, *arguments):
        server = self._start(arguments, stdin=subprocess.PIPE)
        lines = iter(server.stdout.readline, '')
        assert 'ready\n' in lines, f'the external peer {arguments} did not start'

    def ask(self, *arguments):
        """Return the result of a client."""
        client = self._start(arguments)
        output, _ = client.communicate(timeout=200)
        assert client.returncode == 0, output
        (result,) = (line for line in output.splitlines() if line.startswith('result '))
        return json.loads(result.removeprefix('result '))

    def _start(self, arguments, **options):
        return self._start_program(
            ROOT / 'tests' / 'external_peers.py',
            *arguments,
            env=os.environ | {'PYTHONPATH': str(ROOT)},
            **options,
        )


@pytest.fixture
def peers(domain_id, start_program):
    """Return a way to start plain rclpy peers, which are gone when the test ends."""
    return ExternalPeers(start_program)


def said_by(child, node):
    """Return what behaviours of a node have logged, without what the first line begins with."""
    prefix = f'[INFO] [{node}]: '
    said = [line.removeprefix(prefix) for line in child.matching(prefix)]
    # After a second Composer says what a client waits for.
    return [line for line in said if not (line.startswith('Waiting for ') and line.endswith('…'))]


def test_add_two_ints_server_answers_an_external_client(up, peers):
    child = up('add_two_ints_server')
    child.wait_until_ready()
    assert peers.ask('ask_for_sum', 'add_two_ints', -7, 2**40) == 2**40 - 7

    assert child.stop() == 0
    # Lines after the first are indented, so that none looks like a log message of its own.
    start = child.lines.index('[INFO] [minimal_service]: Incoming request')
    assert child.lines[start : start + 3] == [
        '[INFO] [minimal_service]: Incoming request',
        '  a: -7 b: 1099511627776',
        '[INFO] [minimal_service]: Sending back response: [1099511627769]',
    ]


def test_add_two_ints_client_waits_for_an_external_server_and_ends(up, peers):
    child = up('add_two_ints_client', 'b:=-3', '-4')
    child.wait_for_line(f'[INFO] [minimal_client_async]: {WAITING}')
    peers.serve('add_two_ints_server')

    assert child.wait() == 0
    said = said_by(child, 'minimal_client_async')
    assert said[-1] == 'Result of add_two_ints: for -4 + -3 = -7'
    assert said[0] == WAITING
    assert set(said[:-1]) <= {WAITING, ASKING_AGAIN}


def test_fibonacci_server_gives_feedback_and_the_sequence_and_can_be_canceled(up, peers):
    child = up('fibonacci_server')
    child.wait_until_ready()
    outcome = peers.ask('send_goal', 3)

    assert outcome == {
        'accepted': True,
        'feedback': [[0, 1, 1], [0, 1, 1, 2]],
        'status': SUCCEEDED,
        'sequence': [0, 1, 1, 2],
    }
    assert said_by(child, 'fibonacci_action_server') == [
        'Executing goal...',
        'Feedback: [0, 1, 1]',
        'Feedback: [0, 1, 1, 2]',
    ]

    outcome = peers.ask('send_goal', 40, 'cancel')

    assert outcome['status'] == CANCELED
    assert len(outcome['feedback']) < 38
    assert child.stop() == 0


def test_fibonacci_client_sends_order_10_to_an_external_server_and_ends(up, peers):
    peers.serve('fibonacci_server')
    child = up('fibonacci_client')

    assert child.wait() == 0
    sequence = [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]
    said = said_by(child, 'fibonacci_action_client')
    feedback = [f'Received feedback: {sequence[:n]}' for n in range(3, 12)]
    # An external server need not wait for the goal's answer before its first feedback.
    assert sorted(said[:-1]) == sorted(['Goal accepted :)', *feedback])
    assert [line for line in said if line in feedback] == feedback
    assert said[-1] == f'Result: {sequence}'


def test_fibonacci_client_says_that_it_was_refused(up, peers):
    peers.serve('fibonacci_server', 'refuse')
    child = up('fibonacci_client')

    assert child.wait() == 1
    assert said_by(child, 'fibonacci_action_client') == ['Goal rejected :(']


def test_calculator_server_does_what_its_parameter_says(up, peers):
    child = up('calculator_server')
    child.wait_until_ready()
    assert peers.ask('set_operation', 'subtract') == [True, '']
    assert peers.ask('ask_for_sum', 'calculate', 10, 5) == 5

    accepted, reason = peers.ask('set_operation', 'multiply')
    assert not accepted
    assert 'add' in reason
    assert 'subtract' in reason
    client = up('calculator_client', '10', '4', 'subtract')
    assert client.wait() == 0
    assert said_by(client, 'calculator_client') == ['Result: 6']
    assert said_by(child, 'calculator_server') == ['10 - 5 = 5', '10 - 4 = 6']
    assert child.stop() == 0


def test_calculator_client_takes_an_external_server_as_it_is_or_sets_it(up, peers):
    peers.serve('calculator_server')
    results = []
    for words in (['10', '5', 'subtract'], ['10', '5']):
        child = up('calculator_client', *words)
        assert child.wait() == 0, child.output
        results.append(said_by(child, 'calculator_client')[-1])

    assert results == ['Result: 5', 'Result: 5']


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
