"""Guard conditions, waitables, QoS events and actions."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.waitable import NumberOfEntities, Waitable
from spinning import DEADLINE_SEC, spinning, wait_for
from std_msgs.msg import Empty
from test_msgs.action import Fibonacci

from composer.executor import checked_seldom, wait_set_thread
from composer.executor.wait_set_thread import WaitSetThread

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(300, method='thread'),
    pytest.mark.usefixtures('patient'),
]


def test_a_guard_condition_runs_its_callback(node: Any, executor: Any) -> None:
    called: list[int] = []
    guard = node.create_guard_condition(lambda: called.append(1))
    guard.trigger()
    executor.spin_once(timeout_sec=0)
    assert called == [1]
    with spinning(executor):
        for count in range(2, 30):
            guard.trigger()
            wait_for(lambda count=count: len(called) == count)
        node.destroy_guard_condition(guard)


def test_a_destroyed_guard_condition_is_released_at_once(
    node: Any,
    executor: Any,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Nothing else wakes the thread that waits for it.
    monkeypatch.setattr(WaitSetThread, '_timeout_sec', lambda _thread, max_sec: max_sec)
    monkeypatch.setattr(wait_set_thread, '_FLUSH_SEC', 10 * DEADLINE_SEC)
    ticks: list[int] = []
    node.create_timer(0.001, lambda: ticks.append(1))
    with spinning(executor):
        for _ in range(5):
            called: list[int] = []
            guard = node.create_guard_condition(lambda called=called: called.append(1))
            guard.trigger()
            wait_for(lambda called=called: called)
            node.destroy_guard_condition(guard)
            before = len(ticks)
            wait_for(lambda before=before: len(ticks) > before + 1)


def test_an_async_guard_condition(node: Any, executor: Any) -> None:
    steps: list[int] = []

    async def run() -> None:
        steps.append(1)
        await asyncio.sleep(0)
        steps.append(2)

    guard = node.create_guard_condition(run)
    guard.trigger()
    executor.spin_once(timeout_sec=0)
    assert steps == [1]
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert steps == [1, 2]


class _GuardWaitable(Waitable):
    """A waitable that rclpy does not know."""

    def __init__(self, context: Context) -> None:
        super().__init__(ReentrantCallbackGroup())
        self.guard = rclpy.guard_condition.GuardCondition(None, None, context=context)
        self.taken = 0
        self._index = None
        self._is_ready = False

    def __enter__(self) -> None:
        self.guard.handle.__enter__()

    def __exit__(self, *error: object) -> None:
        self.guard.handle.__exit__(*error)

    def is_ready(self, wait_set: Any) -> bool:
        if wait_set.is_ready('guard_condition', self._index):
            self._is_ready = True
        return self._is_ready

    def take_data(self) -> str | None:
        taken, self._is_ready = self._is_ready, False
        return 'data' if taken else None

    async def execute(self, data: str | None) -> None:
        assert data == 'data'
        await asyncio.sleep(0)
        self.taken += 1

    def get_num_entities(self) -> NumberOfEntities:
        return NumberOfEntities(num_gcs=1)

    def add_to_wait_set(self, wait_set: Any) -> None:
        self._index = wait_set.add_guard_condition(self.guard.handle)


def test_a_waitable_of_an_unknown_kind(node: Any, executor: Any, context: Context) -> None:
    waitable = _GuardWaitable(context)
    node.add_waitable(waitable)
    with spinning(executor) as errors:
        for count in range(1, 20):
            waitable.guard.trigger()
            wait_for(lambda count=count: waitable.taken == count)
        node.remove_waitable(waitable)
    assert not errors


def test_qos_events_reach_their_callbacks(node: Any, executor: Any) -> None:
    seen: set[str] = set()
    reliable = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    with spinning(executor):
        node.create_subscription(
            Empty,
            'events',
            lambda _: None,
            reliable,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=lambda _: seen.add('subscription'),
                matched=lambda _: seen.add('matched'),
            ),
        )
        node.create_publisher(
            Empty,
            'events',
            best_effort,
            event_callbacks=PublisherEventCallbacks(
                incompatible_qos=lambda _: seen.add('publisher')
            ),
        )
        wait_for(lambda: {'subscription', 'publisher'} <= seen)
        node.create_publisher(Empty, 'events', reliable)
        wait_for(lambda: 'matched' in seen)


@pytest.mark.parametrize('asynchronous', [False, True])
def test_actions(node: Any, executor: Any, asynchronous) -> None:
    feedback: list[int] = []

    def execute(goal: Any) -> Any:
        for number in range(goal.request.order):
            goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
            time.sleep(0.01)
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result()
        goal.succeed()
        return Fibonacci.Result(sequence=list(range(goal.request.order)))

    async def execute_async(goal: Any) -> Any:
        await asyncio.sleep(0)
        return execute(goal)

    deep = QoSProfile(depth=100)
    server = ActionServer(
        node,
        Fibonacci,
        'fibonacci',
        execute_async if asynchronous else execute,
        cancel_callback=lambda _: rclpy.action.CancelResponse.ACCEPT,
        feedback_pub_qos_profile=deep,
    )
    client = ActionClient(node, Fibonacci, 'fibonacci', feedback_sub_qos_profile=deep)
    with spinning(executor) as errors:
        assert client.wait_for_server(DEADLINE_SEC)
        sent = [
            client.send_goal_async(
                Fibonacci.Goal(order=5), lambda m: feedback.append(m.feedback.sequence[0])
            )
            for _ in range(3)
        ]
        wait_for(lambda: all(goal.done() for goal in sent))
        # rclpy drops the feedback that it takes with or after the result.
        wait_for(lambda: len(feedback) == 15)
        results = [goal.result().get_result_async() for goal in sent]
        wait_for(lambda: all(result.done() for result in results))
        assert list(results[0].result().result.sequence) == [0, 1, 2, 3, 4]
        long = client.send_goal_async(Fibonacci.Goal(order=1000))
        wait_for(long.done)
        cancel = long.result().cancel_goal_async()
        wait_for(cancel.done)
        result = long.result().get_result_async()
        wait_for(result.done)
        assert result.result().status == 5
        client.destroy()
        server.destroy()
        time.sleep(0.05)
    assert not errors


def test_a_goal_can_be_sent_and_awaited_in_a_callback(node: Any, executor: Any) -> None:
    done: list[int] = []

    def execute(goal: Any) -> Any:
        goal.succeed()
        return Fibonacci.Result(sequence=[4])

    ActionServer(node, Fibonacci, 'fibonacci', execute, callback_group=ReentrantCallbackGroup())
    client = ActionClient(node, Fibonacci, 'fibonacci', callback_group=ReentrantCallbackGroup())

    async def send() -> None:
        timer.cancel()
        goal = await client.send_goal_async(Fibonacci.Goal())
        done.append((await goal.get_result_async()).result.sequence[0])

    with spinning(executor):
        assert client.wait_for_server(DEADLINE_SEC)
        timer = node.create_timer(0.01, send)
        wait_for(lambda: done == [4])


def test_finished_goals_expire(context: Context, executor: Any) -> None:
    held: list[int] = []

    def execute(goal: Any) -> Any:
        held.append(len(server._goal_handles))
        goal.succeed()
        return Fibonacci.Result()

    node = rclpy.create_node('acting', context=context)
    server = ActionServer(node, Fibonacci, 'fibonacci', execute, result_timeout=0.3)
    client = ActionClient(node, Fibonacci, 'fibonacci')

    def wait_spinning(condition: Callable[[], Any]) -> None:
        end = time.monotonic() + DEADLINE_SEC
        while not condition():
            assert time.monotonic() < end
            rclpy.spin_once(node, executor=executor, timeout_sec=0.05)

    sent = client.send_goal_async(Fibonacci.Goal())
    wait_spinning(sent.done)
    result = sent.result().get_result_async()
    wait_spinning(result.done)
    wait_spinning(lambda: not server._goal_handles)
    assert held == [1]
    executor.shutdown(DEADLINE_SEC)
    node.destroy_node()


@pytest.mark.parametrize('asynchronous', [False, True])
def test_an_action_server_may_be_destroyed_by_its_goal(
    node: Any, executor: Any, asynchronous
) -> None:
    def accept(_: Any) -> Any:
        server.destroy()
        return rclpy.action.GoalResponse.ACCEPT

    async def accept_later(_: Any) -> Any:
        await asyncio.sleep(0)
        return accept(_)

    server = ActionServer(
        node,
        Fibonacci,
        'fibonacci',
        lambda _: Fibonacci.Result(),
        goal_callback=accept_later if asynchronous else accept,
        handle_accepted_callback=lambda _: None,
    )
    client = ActionClient(node, Fibonacci, 'fibonacci')
    with spinning(executor) as errors:
        assert client.wait_for_server(DEADLINE_SEC)
        sent = client.send_goal_async(Fibonacci.Goal())
        wait_for(sent.done)
        assert sent.result().accepted
    assert not errors


class _Waits:
    """Counts the waits of an executor's wait set thread."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count = 0
        wait = WaitSetThread._wait

        def count_wait(thread: Any, max_sec: float | None) -> None:
            self.count += 1
            wait(thread, max_sec)

        monkeypatch.setattr(WaitSetThread, '_wait', count_wait)


def test_a_qos_event_is_waited_for_and_not_asked_for(
    node: Any, executor: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits = _Waits(monkeypatch)
    matched: list[int] = []
    for number in range(200):
        callbacks = SubscriptionEventCallbacks(
            matched=lambda _, number=number: matched.append(number), use_default_callbacks=False
        )
        node.create_subscription(
            Empty, f'topic_{number}', lambda _: None, 1, event_callbacks=callbacks
        )
    with spinning(executor):
        for number in range(0, 200, 20):
            node.create_publisher(Empty, f'topic_{number}', 1)
            wait_for(lambda number=number: number in matched)
        # Nothing else happens, so it waits.
        wait_for(lambda: _is_constant(lambda: waits.count))
    assert matched == list(range(0, 200, 20))


def _is_constant(read: Callable[[], int]) -> bool:
    before = read()
    time.sleep(0.3)
    return read() == before


def test_thousands_of_default_events_are_asked_for_in_turn(node: Any, executor: Any) -> None:
    warned: list[int] = []
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

    @checked_seldom
    def note(_: Any) -> None:
        warned.append(1)

    for number in range(150):
        callbacks = SubscriptionEventCallbacks(incompatible_qos=note)
        node.create_subscription(
            Empty, f'topic_{number}', lambda _: None, 1, event_callbacks=callbacks
        )
    with spinning(executor):
        for number in (0, 149):
            node.create_publisher(Empty, f'topic_{number}', best_effort)
        wait_for(lambda: len(warned) == 2)
