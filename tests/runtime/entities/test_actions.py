"""Actions that systems serve: how each goal ends, under each rule, for a plain rclpy client."""

import signal
from collections import Counter
from contextlib import ExitStack, closing

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.qos import QoSProfile
from test_msgs.action import Fibonacci

from tests.running import DEADLINE_SEC, wait_for

pytestmark = pytest.mark.ros

STATUS = {
    GoalStatus.STATUS_SUCCEEDED: 'succeeded',
    GoalStatus.STATUS_CANCELED: 'canceled',
    GoalStatus.STATUS_ABORTED: 'aborted',
}

CODE = """
import time

from action_msgs.msg import GoalStatus
from composer import AbortedError
from rclpy.action.server import GoalEvent, ServerGoalHandle

look = ServerGoalHandle.is_cancel_requested.fget

@property
def look_just_before_the_request(goal):
    seen = look(goal)
    if goal.request.order == 777 and goal.status == GoalStatus.STATUS_EXECUTING:
        goal._update_state(GoalEvent.CANCEL_GOAL)
    return seen

ServerGoalHandle.is_cancel_requested = look_just_before_the_request

def plain(node, goal):
    return [goal.order]

async def coroutine(node, goal):
    return {'sequence': [goal.order]}

def generator(node, goal):
    for step in range(goal.order):
        yield [step]
        time.sleep(0.02)
    return [goal.order]

async def async_generator(node, goal):
    for step in range(goal.order):
        yield [step]
    yield [goal.order]

def forever(node, goal):
    try:
        while True:
            yield [goal.order]
            time.sleep(0.01)
    finally:
        node.logger.info(f'cleaned up {goal.order}')

async def forever_async(node, goal):
    try:
        while True:
            yield [goal.order]
            time.sleep(0.01)
    finally:
        node.logger.info(f'cleaned up {goal.order}')

def give_up(node, goal):
    yield [1]
    raise AbortedError('blocked', [goal.order, 7])

def give_up_plain(node, goal):
    raise AbortedError

def interrupted(node, goal):
    try:
        while True:
            yield [goal.order]
            time.sleep(0.01)
    except GeneratorExit:
        return [goal.order, 8]

def fail(node, goal):
    yield [1]
    raise OSError('no such device')

def wrong_feedback(node, goal):
    try:
        yield {'sequense': [1]}  # composer: ignore[unknown-field]
    finally:
        node.logger.info('closed')
    return []

async def accept(node, goal, most=5):
    if goal.order > 100:
        raise OSError('cannot decide')
    if goal.order < 0:
        return False
    return None if goal.order <= most else f'{goal.order} is more than {most}'

def short(node, goal):
    for _ in range(3):
        yield [goal.order]
        time.sleep(0.002)
    return [goal.order]
"""

KINDS = [
    'coroutine',
    'generator',
    'async_generator',
    'forever_async',
    'give_up',
    'give_up_plain',
    'interrupted',
    'fail',
    'wrong_feedback',
]
RULES = ['parallel', 'queue', 'reject', 'preempt']


def serving(actions):
    """Return a system with actions, each with the name of its behaviour and further keys."""
    lines = [
        f"          {name}: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:{behaviour}'{more}}}"
        for name, (behaviour, more) in actions.items()
    ]
    head = 'version: 1\nnodes:\n      server:\n        actions:\n'
    return head + '\n'.join(lines) + '\n'


def by_rule(behaviour):
    """Return an action for each rule, named after both."""
    return {f'{behaviour}_{rule}': (behaviour, f', concurrency: {rule}') for rule in RULES}


class Client:
    """A plain action client of a peer.

    The thread that spins sends, else it may take an answer too early: rclpy notes what it has
    asked for after it has sent it.
    """

    def __init__(self, peer, name):
        deep = QoSProfile(depth=1000)
        self.peer = peer
        self._client = peer.run(
            ActionClient,
            peer.node,
            Fibonacci,
            name,
            goal_service_qos_profile=deep,
            result_service_qos_profile=deep,
            cancel_service_qos_profile=deep,
            feedback_sub_qos_profile=deep,
        )
        assert self._client.wait_for_server(DEADLINE_SEC)
        peer.meet_action_server(name)

    def send(self, order, heard=None):
        """Return the future of a goal handle."""
        return self.peer.run(self._send, order, heard)

    def send_all(self, count):
        """Send goals at once, in order, and return their handles."""
        futures = self.peer.run(lambda: [self._send(n, None) for n in range(count)])
        return [self.accepted(future) for future in futures]

    def _send(self, order, heard):
        hear = (
            None
            if heard is None
            else lambda message: heard.append(list(message.feedback.sequence))
        )
        return self._client.send_goal_async(Fibonacci.Goal(order=order), feedback_callback=hear)

    def accepted(self, future):
        wait_for(future.done, 'the answer to a goal')
        return future.result()

    def begin(self, order, heard=None):
        """Return the handle of a goal that is accepted."""
        handle = self.accepted(self.send(order, heard))
        assert handle.accepted
        return handle

    def end(self, handle):
        """Return how a goal ended, and its result."""
        future = self.peer.run(handle.get_result_async)
        wait_for(future.done, 'the result of a goal')
        return STATUS[future.result().status], list(future.result().result.sequence)

    def cancel(self, handle):
        future = self.peer.run(handle.cancel_goal_async)
        wait_for(future.done, 'the answer to the request to cancel')
        return len(future.result().goals_canceling)

    def close(self):
        self.peer.run(self._client.destroy)


@pytest.fixture(scope='module')
def child(shared_compose):
    actions = {
        **{kind: (kind, '') for kind in KINDS},
        **by_rule('forever'),
        'accept': ('plain', ", accept: 'parts:accept'"),
    }
    child = shared_compose(serving(actions), CODE)
    child.wait_until_ready()
    return child


@pytest.fixture
def connect(child, shared_peer):
    """Return a function that returns a client of an action."""
    with ExitStack() as clients:
        yield lambda name: clients.enter_context(closing(Client(shared_peer, name)))


@pytest.mark.parametrize(
    ('name', 'feedback'),
    [
        ('coroutine', []),
        ('generator', [[0], [1], [2]]),
        ('async_generator', [[0], [1], [2]]),
    ],
)
def test_a_goal_succeeds_with_its_feedback_in_order_and_its_result(connect, name, feedback):
    client = connect(name)
    heard = []

    handle = client.begin(3, heard)
    # rclpy drops the feedback that it takes with or after the result.
    wait_for(lambda: len(heard) == len(feedback), 'the feedback')
    assert client.end(handle) == ('succeeded', [3])
    assert heard == feedback


def test_a_cancelled_goal_ends_at_its_next_yield_with_its_finally(child, connect):
    client = connect('forever_async')
    heard = []
    handle = client.begin(5, heard)
    wait_for(lambda: heard, 'feedback')

    assert client.cancel(handle) == 1
    assert client.end(handle) == ('canceled', [])
    child.wait_for_line('[server]: cleaned up 5')
    # Also by a request that comes after any look for one.
    assert client.end(client.begin(777)) == ('canceled', [])


@pytest.mark.parametrize(
    ('name', 'result', 'said'),
    [
        ('give_up', [2, 7], 'aborted a goal: blocked'),
        ('give_up_plain', [], 'aborted a goal'),
    ],
)
def test_a_planned_abort_has_a_result_and_is_no_error(child, connect, name, result, said):
    client = connect(name)
    assert client.end(client.begin(2)) == ('aborted', result)
    assert said in child.wait_for_line(f"[INFO] [server]: action '{name}'")
    assert not child.matching(f"action '{name}' (system.yaml")


def test_what_a_generator_returns_when_it_is_cancelled_is_the_result(connect):
    client = connect('interrupted')
    heard = []
    handle = client.begin(4, heard)
    # One that has not begun is never interrupted.
    wait_for(lambda: heard, 'the begin')
    assert client.cancel(handle) == 1
    assert client.end(handle) == ('canceled', [4, 8])


@pytest.mark.parametrize(
    ('name', 'summary'),
    [
        ('fail', 'OSError: no such device'),
        (
            'wrong_feedback',
            "PayloadError: test_msgs/action/Fibonacci_Feedback has no field 'sequense'",
        ),
    ],
)
def test_a_behaviour_that_raises_aborts_its_goal_and_is_in_the_log(child, connect, name, summary):
    client = connect(name)

    assert client.end(client.begin(1)) == ('aborted', [])
    assert summary in child.wait_for_line(f"[server]: action '{name}' (system.yaml:")
    if name == 'wrong_feedback':
        child.wait_for_line('[server]: closed')


def test_accept_decides_about_goals(child, connect):
    client = connect('accept')
    refused = "[INFO] [server]: action 'accept' refused a goal"

    assert client.end(client.begin(5)) == ('succeeded', [5])
    assert not client.accepted(client.send(-1)).accepted
    child.wait_for_line(refused)
    assert not client.accepted(client.send(6)).accepted
    child.wait_for_line(f'{refused}: 6 is more than 5')
    assert not client.accepted(client.send(101)).accepted
    error = child.wait_for_line("action 'accept' (accept) (system.yaml:")
    assert 'OSError: cannot decide' in error


def test_goals_of_a_queue_run_in_order_and_one_that_waits_can_be_cancelled(connect):
    client = connect('forever_queue')
    heard = [[], [], []]
    handles = [client.begin(n, heard[n]) for n in range(3)]
    wait_for(lambda: heard[0], 'feedback of the first')

    assert client.cancel(handles[1]) == 1
    assert client.end(handles[1]) == ('canceled', [])
    assert heard[1:] == [[], []]
    assert client.cancel(handles[0]) == 1
    assert client.end(handles[0]) == ('canceled', [])
    wait_for(lambda: heard[2], 'feedback of the last')
    assert client.cancel(handles[2]) == 1
    assert client.end(handles[2]) == ('canceled', [])
    assert heard[1] == []


def test_a_goal_is_refused_while_another_runs(connect):
    client = connect('forever_reject')
    first = client.begin(1)

    assert not client.accepted(client.send(2)).accepted
    assert client.cancel(first) == 1
    assert client.end(first) == ('canceled', [])
    last = client.begin(3)
    assert client.cancel(last) == 1
    assert client.end(last) == ('canceled', [])


def test_a_new_goal_takes_the_place_of_the_one_that_runs(child, connect):
    client = connect('forever_preempt')
    began = []
    first = client.begin(71, began)
    # What has not begun has nothing to clean up.
    wait_for(lambda: began, 'feedback of the first')
    heard = []
    second = client.begin(72, heard)

    assert client.end(first) == ('aborted', [])
    child.wait_for_line('cleaned up 71')
    wait_for(lambda: heard, 'feedback of the second')
    assert client.cancel(second) == 1
    assert client.end(second) == ('canceled', [])


def test_of_many_goals_each_ends_in_one_right_state_also_at_the_stop(compose, peer):
    child = compose(serving(by_rule('short') | by_rule('forever')), CODE)
    with ExitStack() as stack:
        clients = {
            (behaviour, rule): stack.enter_context(closing(Client(peer, f'{behaviour}_{rule}')))
            for behaviour, rules in (('short', ('queue', 'preempt')), ('forever', RULES))
            for rule in rules
        }
        for (behaviour, rule), client in clients.items():
            check_many_goals_at_once(client, rule, behaviour)
        heard = {rule: [] for rule in RULES}
        results = []
        for rule, messages in heard.items():
            client = clients['forever', rule]
            handles = [client.accepted(client.send(n, messages)) for n in range(3)]
            results += [peer.run(handle.get_result_async) for handle in handles if handle.accepted]
        # By then, the requests for results have come.
        for messages in heard.values():
            messages.clear()
        wait_for(lambda: all(len(messages) > 50 for messages in heard.values()), 'feedback')

        assert child.stop(signal.SIGINT) == 0
        wait_for(lambda: all(future.done() for future in results), 'all results')
        assert {STATUS[future.result().status] for future in results} == {'aborted'}
        assert 'rror' not in child.output


def check_many_goals_at_once(client, rule, behaviour):
    count = 10
    handles = client.send_all(count)
    accepted = [n for n, handle in enumerate(handles) if handle.accepted]
    results = client.peer.run(lambda: {n: handles[n].get_result_async() for n in accepted})
    if behaviour == 'forever':
        cancels = client.peer.run(lambda: [handles[n].cancel_goal_async() for n in accepted])
        wait_for(lambda: all(future.done() for future in cancels), 'all answers')
    wait_for(lambda: all(future.done() for future in results.values()), 'all results')

    ends = {n: STATUS[future.result().status] for n, future in results.items()}
    tally = Counter(ends.values())
    good = 'succeeded' if behaviour == 'short' else 'canceled'
    if rule in ('parallel', 'queue'):
        assert tally == {good: count}
    elif rule == 'reject':
        assert set(tally) == {good}
    else:
        assert tally.keys() <= {good, 'aborted'}
        assert ends[count - 1] == good
    if behaviour == 'short':
        assert all(
            list(results[n].result().result.sequence) == ([n] if ends[n] == good else [])
            for n in accepted
        )
    if rule != 'parallel':
        # Nothing is left that would keep another goal from running.
        handle = client.begin(1000)
        assert behaviour == 'short' or client.cancel(handle) == 1
        assert client.end(handle)[0] == good
