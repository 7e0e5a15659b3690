"""Callback groups: who runs beside whom."""

import threading
import time
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.task import Future
from spinning import DEADLINE_SEC, spinning, wait_for
from test_msgs.msg import Strings

from composer.executor import ComposerExecutor

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


def _overlap(node: Any, executor: Any, groups: list[Any]) -> int:
    inside = most = 0
    calls: list[int] = []
    lock = threading.Lock()

    def tick() -> None:
        nonlocal inside, most
        with lock:
            inside += 1
            most = max(most, inside)
        time.sleep(0.01)
        with lock:
            inside -= 1
        calls.append(1)

    for group in groups:
        node.create_timer(0.001, tick, callback_group=group)
    with spinning(executor):
        wait_for(lambda: len(calls) > 30)
    return most


def test_an_exclusive_group_runs_one_callback_at_a_time(node: Any, executor: Any) -> None:
    group = MutuallyExclusiveCallbackGroup()
    assert _overlap(node, executor, [group, group, group]) == 1


def test_a_reentrant_group_runs_a_callback_beside_itself(node: Any, executor: Any) -> None:
    assert _overlap(node, executor, [ReentrantCallbackGroup()]) > 1


def test_a_reentrant_group_that_refuses_is_not_asked_without_end(node: Any, executor: Any) -> None:
    asked: list[bool] = []
    got: list[str] = []
    opened = threading.Event()

    class Gated(ReentrantCallbackGroup):
        def beginning_execution(self, entity: Any) -> bool:
            asked.append(opened.is_set())
            return opened.is_set() and super().beginning_execution(entity)

        def can_execute(self, entity: Any) -> bool:
            return opened.is_set() and super().can_execute(entity)

    publisher = node.create_publisher(Strings, 'topic', 10)
    node.create_subscription(
        Strings,
        'topic',
        lambda message: got.append(message.string_value),
        10,
        callback_group=Gated(),
    )
    with spinning(executor):
        for text in 'abc':
            publisher.publish(Strings(string_value=text))
        wait_for(lambda: asked)
        time.sleep(0.2)
        assert len(asked) < 1000
        opened.set()
        wait_for(lambda: len(got) == 3)
    assert sorted(got) == ['a', 'b', 'c']


def test_num_threads_bounds_what_runs_at_the_same_time(context: Context) -> None:
    executor = ComposerExecutor(num_threads=2, context=context)
    node = rclpy.create_node('node', context=context)
    executor.add_node(node)
    groups = [MutuallyExclusiveCallbackGroup() for _ in range(6)]
    assert _overlap(node, executor, groups) == 2


def test_an_exclusive_group_is_held_while_its_coroutine_waits(node: Any, executor: Any) -> None:
    future = Future(executor=executor)
    began = threading.Event()
    ticks: list[int] = []

    async def hold() -> None:
        timer.cancel()
        began.set()
        await future

    group = MutuallyExclusiveCallbackGroup()
    timer = node.create_timer(0.01, hold, callback_group=group)
    with spinning(executor):
        assert began.wait(DEADLINE_SEC)
        node.create_timer(0.01, lambda: ticks.append(1), callback_group=group)
        time.sleep(0.1)
        assert not ticks
        future.set_result(None)
        wait_for(lambda: ticks)


def test_a_slow_callback_delays_no_other_group(node: Any, executor: Any) -> None:
    let_go = threading.Event()
    ticks: list[int] = []
    for _ in range(5):
        node.create_timer(
            0.01,
            lambda: let_go.wait(DEADLINE_SEC),
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
    node.create_timer(
        0.01, lambda: ticks.append(1), callback_group=MutuallyExclusiveCallbackGroup()
    )
    with spinning(executor):
        wait_for(lambda: len(ticks) > 20)
        let_go.set()
