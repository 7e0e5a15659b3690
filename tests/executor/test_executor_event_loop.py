"""Tasks, coroutines and futures."""

import asyncio
import gc
import threading
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from spinning import DEADLINE_SEC, spinning, wait_for

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(300, method='thread'),
    pytest.mark.usefixtures('patient'),
]


def test_tasks_run_in_the_order_of_rclpy(node: Any, executor: Any) -> None:
    """Oldest first since rclpy 9, newest first before; later tasks after those in any case."""

    def run_order(tasks: Any) -> list[int]:
        order: list[int] = []
        for number in range(5):
            tasks.create_task(order.append, number)
        tasks.spin_once(timeout_sec=0)
        tasks.create_task(order.append, 5)
        while len(order) < 6:
            tasks.spin_once(timeout_sec=0)
        return order

    stock = rclpy.executors.SingleThreadedExecutor(context=node.context)
    expected = run_order(stock)
    stock.shutdown()
    assert run_order(executor) == expected


def test_tasks_await_each_other(node: Any, executor: Any) -> None:
    async def first() -> str:
        return 'first'

    one = executor.create_task(first)

    async def second() -> str:
        return await one + ' second'

    two = executor.create_task(second)
    executor.spin_until_future_complete(two, DEADLINE_SEC)
    assert two.result() == 'first second'


def test_only_the_executor_resumes_a_task(node: Any, executor: Any) -> None:
    """Since rclpy 7.1.9, a task calls these two when its coroutine yields."""
    future = Future(executor=executor)

    async def wait() -> None:
        await future

    task = executor.create_task(wait)
    executor.spin_once(timeout_sec=0)
    executor._call_task_in_next_spin(task)
    task._add_resume_callback(future, executor)
    assert len(future._callbacks) == 1
    executor.spin_once(timeout_sec=0)
    assert not task.done()
    future.set_result(None)
    executor.spin_until_future_complete(task, DEADLINE_SEC)
    assert task.done()


@pytest.mark.parametrize('asynchronous', [False, True])
def test_a_task_runs_with_its_arguments(node: Any, executor: Any, asynchronous) -> None:
    def function(a: int, b: int) -> int:
        return a - b

    async def coroutine(a: int, b: int) -> int:
        return a - b

    task = executor.create_task(coroutine if asynchronous else function, 5, b=3)
    assert not task.done()
    executor.spin_once(timeout_sec=0)
    assert task.result() == 2


def test_a_coroutine_that_yields_is_resumed_by_the_next_spin_once(
    node: Any,
    executor: Any,
) -> None:
    steps: list[int] = []

    async def tick() -> None:
        steps.append(1)
        await asyncio.sleep(0)
        steps.append(2)

    timer = node.create_timer(0.01, tick)
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert steps == [1]
    timer.cancel()
    executor.spin_once(timeout_sec=0)
    assert steps == [1, 2]


def test_a_suspended_callback_is_resumed_when_its_node_is_back(
    context: Context,
    executor: Any,
) -> None:
    waiting = True
    steps: list[int] = []

    class Wait:
        def __await__(self) -> Iterator[None]:
            while waiting:
                yield

    async def tick() -> None:
        steps.append(1)
        await Wait()
        steps.append(2)

    node = rclpy.create_node('node', context=context)
    timer = node.create_timer(0.01, tick)
    rclpy.spin_once(node, executor=executor, timeout_sec=DEADLINE_SEC)
    timer.cancel()
    waiting = False
    executor.spin_once(timeout_sec=0)
    assert steps == [1]
    rclpy.spin_once(node, executor=executor, timeout_sec=0)
    assert steps == [1, 2]


def test_a_suspended_callback_of_a_destroyed_node_is_dropped(
    node: Any,
    context: Context,
    executor: Any,
) -> None:
    awaited: Future = Future()
    ended: list[int] = []

    async def tick() -> None:
        try:
            await awaited
        finally:
            ended.append(1)

    other = rclpy.create_node('other', context=context)
    other.create_timer(0.01, tick)
    rclpy.spin_once(other, executor=executor, timeout_sec=5)
    awaited.set_result(None)
    executor.spin_once(timeout_sec=0)
    other.destroy_node()
    assert not ended
    executor.remove_node(node)
    gc.collect()
    assert ended == [1]


def test_a_coroutine_is_resumed_though_its_future_belongs_to_an_executor_that_never_spins(
    node: Any, executor: Any, context: Context
) -> None:
    idle = SingleThreadedExecutor(context=context)
    future: Future = Future(executor=idle)

    async def wait() -> int:
        return await future

    task = executor.create_task(wait)
    with spinning(executor):
        wait_for(lambda: executor._spinner._loop._runner._paused)
        future.set_result(3)
        wait_for(task.done)
    assert task.result() == 3
    idle.shutdown()


def test_ten_thousand_tasks_from_many_threads_all_run(node: Any, executor: Any) -> None:
    done: list[int] = []

    async def work(number: int) -> None:
        await asyncio.sleep(0)
        done.append(number)

    def create(start: int) -> None:
        for number in range(start, start + 1000):
            executor.create_task(work, number)

    with spinning(executor):
        threads = [threading.Thread(target=create, args=(i * 1000,)) for i in range(10)]
        for thread in threads:
            thread.start()
        wait_for(lambda: len(done) == 10_000)
    assert sorted(done) == list(range(10_000))


def test_a_cancelled_task_does_not_run(node: Any, executor: Any) -> None:
    ran: list[int] = []
    task = executor.create_task(lambda: ran.append(1))
    task.cancel()
    executor.spin_once(timeout_sec=0)
    assert task.cancelled()
    assert not ran
