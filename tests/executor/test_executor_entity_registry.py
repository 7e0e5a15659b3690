"""Nodes and entities that come and go."""

import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.context import Context
from spinning import DEADLINE_SEC, spinning, wait_for, wait_until_quiet
from std_msgs.msg import Empty, Int32

from composer.executor import ComposerExecutor

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


def test_a_subscription_may_destroy_itself_in_its_callback(node: Any, executor: Any) -> None:
    got: list[int] = []

    def take(message: Int32) -> None:
        got.append(message.data)
        node.destroy_subscription(subscription)

    subscription = node.create_subscription(Int32, 'count', take, 10)
    publisher = node.create_publisher(Int32, 'count', 10)
    ticks: list[int] = []
    node.create_timer(0.01, lambda: ticks.append(1))
    with spinning(executor) as errors:
        publisher.publish(Int32(data=1))
        publisher.publish(Int32(data=2))
        wait_for(lambda: len(ticks) > 10)
    assert got == [1]
    assert not errors


def test_a_node_may_destroy_itself_in_its_callback(
    context: Context,
    node: Any,
    executor: Any,
) -> None:
    other = rclpy.create_node('other', context=context)
    other.create_timer(0.01, other.destroy_node)
    executor.add_node(other)
    ticks: list[int] = []
    node.create_timer(0.01, lambda: ticks.append(1))
    with spinning(executor) as errors:
        wait_for(lambda: len(ticks) > 20)
    assert not errors


def test_entities_created_in_a_callback_are_served(node: Any, executor: Any) -> None:
    got: list[int] = []

    def create() -> None:
        timer.cancel()
        node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
        node.create_publisher(Int32, 'count', 10).publish(Int32(data=7))

    timer = node.create_timer(0.01, create)
    with spinning(executor):
        wait_for(lambda: got == [7])


def test_remove_node_stops_its_callbacks(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    node.create_timer(0.005, lambda: ticks.append(1))
    with spinning(executor):
        wait_for(lambda: ticks)
        executor.remove_node(node)
        wait_until_quiet(ticks)
        seen = len(ticks)
        executor.add_node(node)
        wait_for(lambda: len(ticks) > seen)


def test_a_node_moves_to_another_executor(node: Any, executor: Any, context: Context) -> None:
    second = ComposerExecutor(context=context)
    got: list[int] = []
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(Int32, 'count', 10)
    with spinning(executor), spinning(second):
        publisher.publish(Int32(data=1))
        wait_for(lambda: got == [1])
        second.add_node(node)
        assert node not in executor.get_nodes()
        publisher.publish(Int32(data=2))
        wait_for(lambda: got == [1, 2])


def test_a_node_that_is_added_while_the_nodes_are_compared_is_served(
    node: Any, executor: Any, context: Context, monkeypatch: Any
) -> None:
    get_nodes = executor.get_nodes
    late = rclpy.create_node('late', context=context)
    ticks: list[int] = []
    late.create_timer(0.01, lambda: ticks.append(1))

    def get_nodes_slowly() -> list[Any]:
        nodes = get_nodes()
        executor.add_node(late)
        return nodes

    monkeypatch.setattr(executor, 'get_nodes', get_nodes_slowly)
    with spinning(executor):
        wait_for(lambda: ticks)


def test_a_node_leaves_its_executor_before_another_listens_to_it(
    node: Any, executor: Any, context: Context, monkeypatch: Any
) -> None:
    second = ComposerExecutor(context=context)
    got: list[int] = []
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(Int32, 'count', 10)
    remove_node = executor.remove_node

    def remove_node_late(node: Any) -> None:
        second._spinner.registry.refresh()
        remove_node(node)

    monkeypatch.setattr(executor, 'remove_node', remove_node_late)
    with spinning(executor), spinning(second):
        publisher.publish(Int32(data=1))
        wait_for(lambda: got == [1])
        second.add_node(node)
        wait_until_quiet(got)
        publisher.publish(Int32(data=2))
        wait_for(lambda: got == [1, 2])


def test_a_node_that_many_threads_move_is_heard_in_the_end(
    node: Any, executor: Any, context: Context
) -> None:
    executors = [executor, *(ComposerExecutor(context=context) for _ in range(2))]
    got: list[int] = []
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(Int32, 'count', 10)

    def move(number: int) -> None:
        for _ in range(30):
            executors[number].add_node(node)
            node.create_timer(100.0, lambda: None)

    with ExitStack() as stack:
        for one in executors:
            stack.enter_context(spinning(one))
        threads = [threading.Thread(target=move, args=(number,)) for number in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(DEADLINE_SEC)
        assert sum(node in one.get_nodes() for one in executors) == 1
        publisher.publish(Int32(data=1))
        wait_for(lambda: got == [1])


def test_destroyed_entities_leave_no_descriptors(node: Any, executor: Any) -> None:
    def churn(times: int) -> int:
        for _ in range(times):
            subscription = node.create_subscription(Empty, 'gone', lambda _: None, 1)
            timer = node.create_timer(10.0, lambda: None)
            executor.spin_once(timeout_sec=0)
            node.destroy_subscription(subscription)
            node.destroy_timer(timer)
            executor.spin_once(timeout_sec=0)
        return len(list(Path('/proc/self/fd').iterdir()))

    before = churn(5)
    assert churn(30) - before < 10
