"""Goals that behaviours send, to a server of this process and to a plain one."""

import signal
import threading
import time
from contextlib import suppress

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor
from test_msgs.action import Fibonacci

pytestmark = pytest.mark.ros

CODE = """
import time

import composer

def count(node, goal):
    for step in range(goal.order):
        yield [step]
        time.sleep(0.01)
    return [goal.order]

def forever(node, goal):
    while True:
        yield [goal.order]
        time.sleep(0.01)

def fail(node, goal):
    raise OSError('no such device')

def refuse(node, goal):
    return False

def send(node, order=3):
    goal = node.send_goal('act', {'order': order}, timeout=30)
    feedback = [list(message.sequence) for message in goal.feedback]
    result = list(goal.result(timeout=30).sequence)
    node.logger.info(f'end: {feedback} {result} {goal.status}')
    yield

async def send_async(node):
    goal = node.send_goal('act', {'order': 3}, timeout=30)
    result = await goal.result_async()
    node.logger.info(f'end: {list(result.sequence)} {goal.status}')
    yield

def cancel(node):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    next(iter(goal.feedback))
    before = goal.status
    agreed = goal.cancel(timeout=30)
    goal.result(timeout=30)
    node.logger.info(f'end: {before} {agreed} {goal.status}')
    yield

def send_and_tell(node, timeout=30, patience=30):
    try:
        goal = node.send_goal('act', {'order': 1}, timeout=timeout)
        goal.result(timeout=patience)
    except composer.GoalError as error:
        node.logger.info(f'{type(error).__name__}: {error}')
    else:
        node.logger.info(f'end: {goal.status}')
    yield

def send_only(node, order=5):
    node.send_goal('act', {'order': order}, timeout=30)
    yield

def alone(node):
    node.state.inside += 1
    most = node.state.inside
    time.sleep(0.005)
    node.state.inside -= 1
    if most > 1:
        node.logger.info('not alone')

def hear(node, feedback):
    alone(node)
    node.logger.info(f'feedback: {list(feedback.sequence)}')

def take(node, result):
    alone(node)
    node.logger.info(f'result: {list(result.sequence)}')

async def hear_async(node, feedback):
    hear(node, feedback)

async def take_async(node, result):
    take(node, result)

def wait_for_result(node, *_):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    node.logger.info('waiting')
    goal.result(timeout=None)

async def wait_for_result_async(node, *_):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    node.logger.info('waiting')
    await goal.result_async()

def wait_for_feedback(node, *_):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    node.logger.info('waiting')
    for _ in goal.feedback:
        pass

def wait_for_server(node, *_):
    node.logger.info('waiting')
    node.send_goal('act', {'order': 1}, timeout=None)
"""


def acting(behaviour, *, server=None, client='', more=''):
    """Return a system whose client does this once; `server` is its action's behaviour."""
    clients = {'client': {'behaviour': behaviour, 'client': client, 'more': more}}
    return acting_together(clients, {} if server is None else {'act': server})


def acting_together(clients, actions):
    """Return a system of several clients: the action of each is `act`, if it names no other.

    `actions` are those of its server: their behaviours by their names.
    """
    lines = """
        version: 1
        nodes:
"""
    for name, keys in clients.items():
        lines += f"""
          {name}:
            state: {{inside: 0}}
            action_clients: {{act: {{type: test_msgs/action/Fibonacci{keys.get('client', '')}}}}}
            timers:
              tick: {{period: 0.02, behaviour: 'parts:{keys['behaviour']}'{keys.get('with', '')}}}
              {keys.get('more', '')}
    """
    if actions:
        lines += """
          server:
            actions:
"""
    for name, behaviour in actions.items():
        lines += f"""
              {name}: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:{behaviour}'}}
    """
    return lines


class PlainServer:
    """A plain action server in a context of its own; orders above 100 are refused.

    Odd orders succeed, even ones run until they are cancelled.
    """

    def __init__(self, domain_id):
        import rclpy

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain_id)
        self.node = rclpy.create_node('plain', context=self.context, use_global_arguments=False)
        self._ended = threading.Event()
        self._has_vanished = False
        self._server = ActionServer(
            self.node,
            Fibonacci,
            'act',
            self._execute,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=lambda goal: GoalResponse(1 if goal.order > 100 else 2),
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
        )
        self._executor = MultiThreadedExecutor(4, context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def vanish(self):
        """Leave the graph, and what it has begun undone."""
        self._server.destroy()
        self._has_vanished = True

    def close(self):
        self._ended.set()
        self._executor.wake()
        self._thread.join()
        self._executor.shutdown()
        if not self._has_vanished:
            self._server.destroy()
        self.node.destroy_node()
        self.context.try_shutdown()
        self.context.destroy()

    def _execute(self, goal):
        # The client's ends are found one after the other, that for feedback before this one.
        while not (self.node.count_subscribers('act/_action/status') or self._ended.is_set()):
            time.sleep(0.01)
        order, step = goal.request.order, 0
        while not self._ended.is_set():
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=[-1])
            if order % 2 and step == order:
                goal.succeed()
                return Fibonacci.Result(sequence=[order])
            with suppress(InvalidHandle):
                goal.publish_feedback(Fibonacci.Feedback(sequence=[step]))
            step += 1
            time.sleep(0.02)
        with suppress(InvalidHandle):
            goal.abort()
        return Fibonacci.Result()

    def _spin(self):
        while not self._ended.is_set():
            with suppress(InvalidHandle):
                self._executor.spin_once(timeout_sec=0.1)


@pytest.fixture
def plain_server(domain_id):
    server = PlainServer(domain_id)
    yield server
    server.close()


SENDERS = {'sync': {'behaviour': 'send'}, 'coroutine': {'behaviour': 'send_async'}}
ENDS = {'sync': 'end: [[0], [1], [2]] [3] succeeded', 'coroutine': 'end: [3] succeeded'}


def test_a_goal_of_this_process_has_feedback_and_a_result(compose):
    child = compose(acting_together(SENDERS, {'act': 'count'}), CODE)

    for name, end in ENDS.items():
        assert child.wait_for_line(f'[{name}]: end: ') == f'[INFO] [{name}]: {end}'
    assert child.stop() == 0


def test_a_goal_of_a_plain_server_has_feedback_and_a_result(compose, plain_server):
    child = compose(acting_together(SENDERS, {}), CODE)

    for name, end in ENDS.items():
        assert child.wait_for_line(f'[{name}]: end: ') == f'[INFO] [{name}]: {end}'
    assert child.stop() == 0


def test_a_goal_ends_when_its_server_has_gone(compose, plain_server):
    child = compose(
        acting('stay', client=", result: 'parts:take'"),
        CODE
        + """
def stay(node):
    goal = node.send_goal('act', {'order': 2}, timeout=30)
    for feedback in goal.feedback:
        if list(feedback.sequence) == [9]:
            node.logger.info('feedback comes')
    try:
        goal.result()
    except composer.ActionNotAvailableError as error:
        node.logger.info(f'{goal.status}: {error}')
""",
    )
    child.wait_for_line('feedback comes')
    plain_server.vanish()
    child.wait_for_line("[client]: unknown: the action server '/act' ended before the goal did")
    assert child.stop() == 0


def test_a_goal_can_be_cancelled(compose):
    child = compose(acting('cancel', server='forever'), CODE)

    assert child.wait_for_line('end: ') == '[INFO] [client]: end: executing True canceled'
    child.wait_for_line("[WARN] [client]: the goal of '/act' was canceled")
    assert child.stop() == 0


ERRORS = {
    'refused': ('', "GoalRejectedError: the server of '/refused' refused the goal"),
    'missing': (
        ', with: {timeout: 0.2}',
        "ActionNotAvailableError: no server of the action '/missing' appeared within 0.2 s",
    ),
    'slow': (
        ', with: {patience: 0.2}',
        "GoalTimeoutError: the goal of '/slow' did not end within 0.2 s",
    ),
    'failing': ('', 'end: aborted'),
}
SERVERS = {
    'refused': "count', accept: 'parts:refuse",
    'slow': 'forever',
    'failing': 'fail',
}


def test_a_client_is_told_why_a_goal_does_not_succeed(compose):
    clients = {
        kind: {
            'behaviour': 'send_and_tell',
            'client': f', action: {kind}',
            'with': arguments,
        }
        for kind, (arguments, _) in ERRORS.items()
    }
    child = compose(acting_together(clients, SERVERS), CODE)

    for kind, (_, message) in ERRORS.items():
        child.wait_for_line(f'[INFO] [{kind}]: {message}')
    assert child.stop() == 0
    for kind, (_, message) in ERRORS.items():
        assert f'[INFO] [{kind}]: {message}' in child.lines


def test_feedback_and_result_behaviours_hear_all_in_order_and_never_beside_others(compose):
    clients = {
        name: {
            'behaviour': 'send_only',
            'client': f", feedback: 'parts:{hear}', result: 'parts:{take}'",
            'more': "other: {period: 0.003, behaviour: 'parts:alone'}",
        }
        for name, hear, take in (
            ('plain', 'hear', 'take'),
            ('coroutine', 'hear_async', 'take_async'),
        )
    }
    child = compose(acting_together(clients, {'act': 'count'}), CODE)
    for name in clients:
        child.wait_for_line(f'[{name}]: result: ')

    for name in clients:
        told = [line.partition(f'[{name}]: ')[2] for line in child.matching(f'[{name}]: ')]
        assert told == [*(f'feedback: [{step}]' for step in range(5)), 'result: [5]']
    assert child.stop() == 0


def test_the_result_behaviour_hears_of_an_aborted_goal_too(compose):
    child = compose(acting('send_only', server='fail', client=", result: 'parts:take'"), CODE)
    child.wait_for_line("[WARN] [client]: the goal of '/act' was aborted")
    child.wait_for_line('[client]: result: []')


WAITING = ['wait_for_result', 'wait_for_result_async', 'wait_for_feedback', 'wait_for_server']


def test_a_signal_ends_timers_that_wait_for_goals(compose):
    clients = {behaviour: {'behaviour': behaviour} for behaviour in WAITING}
    clients['wait_for_server']['client'] = ', action: missing'
    child = compose(acting_together(clients, {'act': 'forever'}), CODE)
    check_that_a_signal_ends_it(child, waiting=len(WAITING))


@pytest.mark.parametrize('behaviour', WAITING)
def test_a_signal_ends_an_on_start_that_waits_for_a_goal(compose, behaviour):
    text = acting(behaviour, server=None if behaviour == 'wait_for_server' else 'forever')
    text = text.replace('timers:\n', f'on_start: parts:{behaviour}\n').replace(
        f"              tick: {{period: 0.02, behaviour: 'parts:{behaviour}'}}\n", ''
    )
    check_that_a_signal_ends_it(compose(text, CODE), code=130)


def check_that_a_signal_ends_it(child, waiting=1, code=0):
    child.wait_for_line('waiting', times=waiting)

    assert child.stop(signal.SIGINT) == code, child.output
    assert 'rror' not in child.output
    assert 'did not end' not in child.output


def test_a_signal_ends_a_wait_for_a_goal_of_a_plain_server(compose, plain_server):
    child = compose(
        acting('wait_for_result').replace('parts:', 'parts:even_'),
        CODE
        + """
def even_wait_for_result(node):
    goal = node.send_goal('act', {'order': 2}, timeout=30)
    node.logger.info('waiting')
    goal.result(timeout=None)
""",
    )
    child.wait_for_line('waiting')

    assert child.stop(signal.SIGINT) == 0, child.output
    assert 'rror' not in child.output
