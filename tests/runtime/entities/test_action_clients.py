"""Goals that behaviours send, to a server of this process and to a plain one."""

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

def wait_for_result(node, order=1):
    goal = node.send_goal('act', {'order': order}, timeout=30)
    node.logger.info('waiting')
    goal.result(timeout=None)

async def wait_for_result_async(node):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    node.logger.info('waiting')
    await goal.result_async()

def wait_for_feedback(node):
    goal = node.send_goal('act', {'order': 1}, timeout=30)
    node.logger.info('waiting')
    for _ in goal.feedback:
        pass

def stay(node):
    goal = node.send_goal('act', {'order': 2}, timeout=30)
    for feedback in goal.feedback:
        if list(feedback.sequence) == [9]:
            node.logger.info('feedback comes')
    try:
        goal.result()
    except composer.ActionNotAvailableError as error:
        node.logger.info(f'{goal.status}: {error}')

def wait_for_server(node):
    node.logger.info('waiting')
    node.send_goal('act', {'order': 1}, timeout=None)
"""


def acting(clients, actions=None):
    """Return a system of clients: the keys of each, and those of its action client `act`.

    Args:
        actions: The behaviours of the server's actions, by their names.
    """
    lines = 'version: 1\nnodes:\n'
    for name, (keys, action) in clients.items():
        lines += f"""
  {name}:
    state: {{inside: 0}}
    action_clients: {{act: {{type: test_msgs/action/Fibonacci{action}}}}}
    {keys}
"""
    if actions:
        lines += '  server:\n    actions:\n'
        lines += ''.join(
            f"      {name}: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:{behaviour}'}}\n"
            for name, behaviour in actions.items()
        )
    return lines


def ticking(behaviour, more=''):
    """Return a timer that does something; `more` are other keys of it, and other timers."""
    return f"timers: {{tick: {{period: 0.02, behaviour: 'parts:{behaviour}'{more or '}'}}}"


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


SENDERS = {'sync': (ticking('send'), ''), 'coroutine': (ticking('send_async'), '')}
ALONE = "}, other: {period: 0.003, behaviour: 'parts:alone'}"
CLIENTS = {
    **SENDERS,
    'cancelling': (ticking('cancel'), ', action: forever'),
    'refused': (ticking('send_and_tell'), ', action: refused'),
    'missing': (ticking('send_and_tell', ', with: {timeout: 0.2}}'), ', action: missing'),
    'slow': (ticking('send_and_tell', ', with: {patience: 0.2}}'), ', action: forever'),
    'failing': (ticking('send_and_tell'), ', action: failing'),
    'hearing': (ticking('send_only', ALONE), ', feedback: parts:hear, result: parts:take'),
    'hearing_async': (
        ticking('send_only', ALONE),
        ', feedback: parts:hear_async, result: parts:take_async',
    ),
    'aborted': (ticking('send_only'), ', action: failing, result: parts:take'),
}
ACTIONS = {
    'act': 'count',
    'refused': "count', accept: 'parts:refuse",
    'forever': "forever', concurrency: 'parallel",
    'failing': "fail', concurrency: 'parallel",
}
ENDS = {
    'sync': 'end: [[0], [1], [2]] [3] succeeded',
    'coroutine': 'end: [3] succeeded',
}
TOLD = {
    **ENDS,
    'cancelling': 'end: executing True canceled',
    'refused': "GoalRejectedError: the server of '/refused' refused the goal",
    'missing': "ActionNotAvailableError: no server of the action '/missing' appeared within 0.2 s",
    'slow': "GoalTimeoutError: the goal of '/forever' did not end within 0.2 s",
    'failing': 'end: aborted',
    'aborted': 'result: []',
}


def test_goals_of_this_process_tell_how_they_end(compose):
    child = compose(acting(CLIENTS, ACTIONS), CODE)
    for name, line in TOLD.items():
        child.wait_for_line(f'[INFO] [{name}]: {line}')
    child.wait_for_line("[WARN] [cancelling]: the goal of '/forever' was canceled")
    child.wait_for_line("[WARN] [aborted]: the goal of '/failing' was aborted")
    # They hear all in order, and never beside others.
    for name in ('hearing', 'hearing_async'):
        child.wait_for_line(f'[{name}]: result: ')
        told = [line.partition(f'[{name}]: ')[2] for line in child.matching(f'[{name}]: ')]
        assert told == [*(f'feedback: [{step}]' for step in range(5)), 'result: [5]']
    assert child.stop() == 0
    for name, line in TOLD.items():
        assert f'[INFO] [{name}]: {line}' in child.lines


def test_goals_of_a_plain_server_have_feedback_and_results_and_a_signal_ends_them(
    compose, plain_server
):
    # The plain server runs even orders until they are cancelled.
    waiting = ticking('wait_for_result', ', with: {order: 2}}')
    child = compose(acting({**SENDERS, 'waiting': (waiting, '')}), CODE)
    for name, end in ENDS.items():
        assert child.wait_for_line(f'[{name}]: end: ') == f'[INFO] [{name}]: {end}'
    check_that_a_signal_ends_it(child)


def test_a_goal_ends_when_its_server_has_gone(compose, plain_server):
    child = compose(acting({'client': (ticking('stay'), ', result: parts:take')}), CODE)
    child.wait_for_line('feedback comes')
    plain_server.vanish()
    child.wait_for_line("[client]: unknown: the action server '/act' ended before the goal did")
    assert child.stop() == 0


WAITING = ['wait_for_result', 'wait_for_result_async', 'wait_for_feedback', 'wait_for_server']


def test_a_signal_ends_timers_that_wait_for_goals(compose):
    clients = {each: (ticking(each), '') for each in WAITING}
    clients['wait_for_server'] = ticking('wait_for_server'), ', action: missing'
    child = compose(acting(clients, {'act': 'forever'}), CODE)
    check_that_a_signal_ends_it(child, waiting=len(WAITING))


def check_that_a_signal_ends_it(child, waiting=1):
    child.wait_for_line('waiting', times=waiting)

    assert child.stop() == 0, child.output
    assert 'rror' not in child.output
    assert 'did not end' not in child.output
