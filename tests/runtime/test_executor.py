"""The promises of rclpy's executors, kept by `ComposerExecutor`."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import ClockType
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import ShutdownException
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from rclpy.waitable import NumberOfEntities, Waitable
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty, Int32
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

from composer.runtime.executor import ComposerExecutor

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(120, method='thread')]
DEADLINE_SEC = 20.0


def wait_for(condition: Callable[[], Any]) -> None:
    """Wait until the condition holds; fail after the deadline."""
    end = time.monotonic() + DEADLINE_SEC
    while not condition():
        assert time.monotonic() < end, 'the condition never held'
        time.sleep(0.002)


@contextmanager
def spinning(executor: Any) -> Iterator[list[BaseException]]:
    """Spin in another thread meanwhile; what spin raised is in the list."""
    errors: list[BaseException] = []

    def spin() -> None:
        try:
            executor.spin()
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield errors
    finally:
        executor.shutdown(5.0)
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()


# spin, spin_once and their friends


def test_spin_once_runs_one_callback(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    node.create_timer(0.01, lambda: ticks.append(1))
    executor.spin_once(timeout_sec=5)
    assert ticks == [1]


def test_spin_once_with_zero_timeout_does_not_wait(node: Any, executor: Any) -> None:
    node.create_timer(100.0, lambda: None)
    executor.spin_once(timeout_sec=0)


def test_spin_once_returns_at_its_timeout(node: Any, executor: Any) -> None:
    begin = time.monotonic()
    executor.spin_once(timeout_sec=0.1)
    assert time.monotonic() - begin >= 0.1


def test_spin_once_returns_though_its_callback_blocks(node: Any, executor: Any) -> None:
    let_go = threading.Event()
    over = threading.Event()

    def block() -> None:
        let_go.wait(DEADLINE_SEC)
        over.set()

    node.create_timer(0.01, block)
    executor.spin_once(timeout_sec=5)
    assert not over.is_set()
    let_go.set()
    assert over.wait(DEADLINE_SEC)


def test_spin_once_serves_a_node_that_is_added_while_it_waits(context: Any, executor: Any) -> None:
    node = rclpy.create_node('late', context=context)
    ticked = threading.Event()
    node.create_timer(0.01, ticked.set)
    thread = threading.Thread(target=executor.spin_once)
    thread.start()
    executor.add_node(node)
    thread.join(DEADLINE_SEC)
    assert ticked.is_set()
    node.destroy_node()


def test_spin_until_future_complete_returns_when_a_callback_sets_it(
    node: Any,
    executor: Any,
) -> None:
    future = Future()
    node.create_timer(0.01, lambda: future.set_result(3))
    executor.spin_until_future_complete(future)
    assert future.result() == 3


def test_spin_until_future_complete_returns_when_a_thread_sets_it(
    node: Any,
    executor: Any,
) -> None:
    future = Future()
    threading.Timer(0.05, future.set_result, ('x',)).start()
    executor.spin_until_future_complete(future, timeout_sec=-1)
    assert future.result() == 'x'


def test_spin_until_future_complete_keeps_its_timeout_beside_a_blocked_callback(
    node: Any,
    executor: Any,
) -> None:
    let_go = threading.Event()
    node.create_timer(0.01, lambda: let_go.wait(DEADLINE_SEC))
    begin = time.monotonic()
    executor.spin_until_future_complete(Future(), timeout_sec=0.2)
    assert 0.2 <= time.monotonic() - begin < DEADLINE_SEC / 2
    let_go.set()


def test_spin_until_future_complete_with_zero_timeout_returns(node: Any, executor: Any) -> None:
    executor.spin_until_future_complete(Future(), timeout_sec=0)


def test_spin_once_until_future_complete_returns_when_it_is_done(
    node: Any,
    executor: Any,
) -> None:
    future = Future()
    threading.Timer(0.05, future.set_result, (1,)).start()
    executor.spin_once_until_future_complete(future, None)
    assert future.done()


def test_rclpy_functions_take_the_executor(context: Any, executor: Any) -> None:
    node = rclpy.create_node('given', context=context)
    future = Future()
    ticks: list[int] = []

    def tick() -> None:
        ticks.append(1)
        if len(ticks) > 2:
            future.set_result(None)

    node.create_timer(0.01, tick)
    rclpy.spin_once(node, executor=executor, timeout_sec=5)
    assert len(ticks) == 1
    rclpy.spin_until_future_complete(node, future, executor, 10)
    assert future.done()
    thread = threading.Thread(target=rclpy.spin, args=(node, executor))
    thread.start()
    wait_for(lambda: len(ticks) > 5)
    context.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


def test_spin_can_go_on_after_an_exception(node: Any, executor: Any) -> None:
    calls: list[int] = []

    def fail() -> None:
        calls.append(1)
        raise ValueError(len(calls))

    node.create_timer(0.01, fail)
    for number in (1, 2, 3):
        with pytest.raises(ValueError, match=str(number)):
            executor.spin()


def test_spin_once_raises_what_a_callback_raises(node: Any, executor: Any) -> None:
    def fail() -> None:
        raise KeyError

    node.create_timer(0.01, fail)
    with pytest.raises(KeyError):
        executor.spin_once(timeout_sec=5)


@pytest.mark.parametrize('kind', ['function', 'coroutine', 'suspended'])
def test_an_exception_of_a_task_is_raised_from_spin(node: Any, executor: Any, kind: str) -> None:
    def function() -> None:
        raise ArithmeticError

    async def coroutine() -> None:
        raise ArithmeticError

    async def suspended() -> None:
        await asyncio.sleep(0)
        raise ArithmeticError

    executor.create_task(
        {'function': function, 'coroutine': coroutine, 'suspended': suspended}[kind]
    )
    with pytest.raises(ArithmeticError):
        executor.spin()


def test_an_exception_of_an_async_callback_is_raised_from_spin(node: Any, executor: Any) -> None:
    async def fail() -> None:
        await asyncio.sleep(0)
        raise LookupError

    node.create_timer(0.01, fail)
    with pytest.raises(LookupError):
        executor.spin()


def test_system_exit_in_a_callback_is_raised_from_spin(node: Any, executor: Any) -> None:
    node.create_timer(0.01, lambda: sys.exit(3))
    with pytest.raises(SystemExit):
        executor.spin()


# shutdown, wake, contexts, signals


def test_wait_for_ready_callbacks_raises_after_shutdown(executor: Any) -> None:
    executor.shutdown()
    with pytest.raises(ShutdownException):
        executor.wait_for_ready_callbacks()


def test_shutdown_ends_spin_at_once(node: Any, executor: Any) -> None:
    thread = threading.Thread(target=executor.spin)
    thread.start()
    assert executor.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


def test_shutdown_waits_for_a_callback_and_reports_a_stuck_one(node: Any, executor: Any) -> None:
    let_go = threading.Event()
    began = threading.Event()
    node.create_timer(0.01, lambda: (began.set(), let_go.wait(DEADLINE_SEC)))
    thread = threading.Thread(target=executor.spin)
    thread.start()
    assert began.wait(DEADLINE_SEC)
    assert not executor.shutdown(timeout_sec=0.05)
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    let_go.set()
    assert executor.shutdown()


def test_shutdown_from_a_callback(node: Any, executor: Any) -> None:
    results: list[bool] = []
    node.create_timer(0.01, lambda: results.append(executor.shutdown()))
    executor.spin()
    assert results == [True]


def test_shutdown_of_the_context_from_a_callback_ends_spin(
    node: Any,
    executor: Any,
    context: Context,
) -> None:
    node.create_timer(0.01, context.shutdown)
    executor.spin()
    assert not context.ok()


def test_no_callback_begins_after_spin_has_returned(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    node.create_timer(0.001, lambda: ticks.append(1))
    executor.spin_until_future_complete(Future(), timeout_sec=0.1)
    seen = len(ticks)
    assert seen
    time.sleep(0.05)
    assert len(ticks) == seen


@pytest.mark.parametrize('name', ['SIGINT', 'SIGTERM'])
@pytest.mark.parametrize('how', ['spin', 'spin_once', 'busy'])
def test_signals_end_spin(name: str, how: str) -> None:
    program = f"""
import rclpy, threading, time
from composer.runtime.executor import ComposerExecutor
rclpy.init(domain_id={100 + os.getpid() % 100})
node = rclpy.create_node('node')
executor = ComposerExecutor()
executor.add_node(node)
if {how!r} == 'busy':
    node.create_timer(0.001, lambda: time.sleep(0.0005))
print('ready', flush=True)
try:
    rclpy.spin(node, executor) if {how!r} == 'spin_once' else executor.spin()
    print('returned', flush=True)
except KeyboardInterrupt:
    print('interrupted', flush=True)
"""
    process = subprocess.Popen([sys.executable, '-c', program], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == 'ready\n'
    time.sleep(0.3)
    process.send_signal(getattr(signal, name))
    try:
        output, _ = process.communicate(timeout=DEADLINE_SEC)
    finally:
        process.kill()
        process.communicate()
    assert output in ('interrupted\n', 'returned\n')
    assert process.returncode == 0


def test_spin_ends_when_a_signal_ends_the_context_during_a_look_at_events(
    node: Any, executor: Any, context: Context, monkeypatch: Any
) -> None:
    lane = executor._engine.lane
    sweep = lane._sweep

    def sweep_in_vain() -> None:
        if lane._default.sources:
            context.handle.shutdown()  # As rclpy's handler of signals does it.
            lane._default.due = 0.0
        sweep()

    monkeypatch.setattr(lane, '_sweep', sweep_in_vain)
    node.create_subscription(Empty, 'looked_at', lambda _: None, 1)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


def test_two_executors_of_two_contexts_do_not_meet(executor: Any, node: Any) -> None:
    other = Context()
    rclpy.init(context=other, domain_id=101)
    second = ComposerExecutor(context=other)
    other_node = rclpy.create_node('node', context=other)
    second.add_node(other_node)
    ticks: set[str] = set()
    node.create_timer(0.01, lambda: ticks.add('first'))
    other_node.create_timer(0.01, lambda: ticks.add('second'))
    with spinning(executor), spinning(second):
        wait_for(lambda: len(ticks) == 2)
    other.shutdown()


def test_a_group_shared_by_two_executors_is_exclusive(executor: Any, context: Context) -> None:
    second = ComposerExecutor(context=context)
    group = MutuallyExclusiveCallbackGroup()
    inside = most = total = 0

    def tick() -> None:
        nonlocal inside, most, total
        inside += 1
        most = max(most, inside)
        time.sleep(0.003)
        inside -= 1
        total += 1

    nodes = [rclpy.create_node(name, context=context) for name in ('first', 'second')]
    for node, some in zip(nodes, (executor, second), strict=True):
        node.create_timer(0.002, tick, callback_group=group)
        some.add_node(node)
    with spinning(executor), spinning(second):
        wait_for(lambda: total > 50)
    assert most == 1


def test_the_executor_can_be_forgotten(context: Context) -> None:
    executor = ComposerExecutor(context=context)
    node = rclpy.create_node('node', context=context)
    executor.add_node(node)
    executor.spin_once(timeout_sec=0.01)
    executor.shutdown()
    gone = weakref.ref(executor)
    del executor

    def is_gone() -> bool:
        import gc

        gc.collect()
        return gone() is None

    wait_for(is_gone)


# groups


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


def test_two_exclusive_groups_run_beside_each_other(node: Any, executor: Any) -> None:
    groups = [MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()]
    assert _overlap(node, executor, groups) == 2


def test_a_reentrant_group_runs_a_callback_beside_itself(node: Any, executor: Any) -> None:
    assert _overlap(node, executor, [ReentrantCallbackGroup()]) > 1


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


# tasks and coroutines


def test_tasks_run_newest_first_and_await_each_other(node: Any, executor: Any) -> None:
    async def first() -> str:
        return 'first'

    one = executor.create_task(first)

    async def second() -> str:
        return await one + ' second'

    two = executor.create_task(second)
    executor.spin_once(timeout_sec=0)
    executor.spin_once(timeout_sec=0)
    assert one.done()
    assert not two.done()
    executor.spin_once(timeout_sec=1)
    assert two.result() == 'first second'


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
    executor.spin_once(timeout_sec=5)
    assert steps == [1]
    timer.cancel()
    executor.spin_once(timeout_sec=0)
    assert steps == [1, 2]


def test_a_suspended_callback_goes_on_when_its_node_is_back(
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
    rclpy.spin_once(node, executor=executor, timeout_sec=5)
    timer.cancel()
    waiting = False
    executor.spin_once(timeout_sec=0)
    assert steps == [1]
    rclpy.spin_once(node, executor=executor, timeout_sec=0)
    assert steps == [1, 2]


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


# subscriptions


def test_messages_keep_their_order_and_none_is_lost(node: Any, executor: Any) -> None:
    got: list[int] = []
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 5000)
    publisher = node.create_publisher(Int32, 'count', 5000)
    with spinning(executor):
        for number in range(3000):
            publisher.publish(Int32(data=number))
        wait_for(lambda: len(got) == 3000)
    assert got == list(range(3000))


def test_messages_published_before_spin_arrive(node: Any, executor: Any) -> None:
    got: list[int] = []
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
    publisher = node.create_publisher(Int32, 'count', 10)
    for number in range(5):
        publisher.publish(Int32(data=number))
    with spinning(executor):
        wait_for(lambda: len(got) == 5)


def test_a_slow_subscription_drops_as_its_depth_says(node: Any, executor: Any) -> None:
    got: list[int] = []
    began = threading.Event()
    let_go = threading.Event()

    def take(message: Int32) -> None:
        got.append(message.data)
        began.set()
        let_go.wait(DEADLINE_SEC)

    node.create_subscription(Int32, 'count', take, 3)
    publisher = node.create_publisher(Int32, 'count', 100)
    with spinning(executor):
        publisher.publish(Int32(data=0))
        assert began.wait(DEADLINE_SEC)
        for number in range(1, 100):
            publisher.publish(Int32(data=number))
        let_go.set()
        wait_for(lambda: got[-1] == 99)
    assert got == [0, 97, 98, 99]


def test_an_async_subscription_gets_every_message(node: Any, executor: Any) -> None:
    got: list[int] = []

    async def take(message: Int32) -> None:
        await asyncio.sleep(0)
        got.append(message.data)

    node.create_subscription(Int32, 'count', take, 100)
    publisher = node.create_publisher(Int32, 'count', 100)
    with spinning(executor):
        for number in range(50):
            publisher.publish(Int32(data=number))
        wait_for(lambda: len(got) == 50)
    assert got == list(range(50))


def test_a_subscription_can_ask_for_message_info_and_raw_bytes(node: Any, executor: Any) -> None:
    got: list[Any] = []

    def take(message: Any, info: Any) -> None:
        got.append((message, info))

    node.create_subscription(Int32, 'count', take, 10, raw=True)
    publisher = node.create_publisher(Int32, 'count', 10)
    with spinning(executor):
        publisher.publish(Int32(data=1))
        wait_for(lambda: got)
    assert isinstance(got[0][0], bytes)
    assert got[0][1]['publication_sequence_number'] == 1


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
        time.sleep(0.01)
        seen = len(ticks)
        time.sleep(0.1)
        assert len(ticks) == seen
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


# services and clients


def test_a_service_can_be_called_from_a_callback_of_another_group(
    node: Any,
    executor: Any,
) -> None:
    answers: list[str] = []
    client = node.create_client(Trigger, 'greet', callback_group=MutuallyExclusiveCallbackGroup())
    node.create_service(
        Trigger, 'greet', lambda _, r: _filled(r), callback_group=MutuallyExclusiveCallbackGroup()
    )
    node.create_timer(0.01, lambda: answers.append(client.call(Trigger.Request()).message))
    with spinning(executor):
        wait_for(lambda: len(answers) > 20)
    assert set(answers) == {'hello'}


def _filled(response: Any) -> Any:
    response.message = 'hello'
    return response


def test_an_async_service_and_an_async_caller(node: Any, executor: Any) -> None:
    answers: list[str] = []
    gate = Future(executor=executor)

    async def serve(_: Any, response: Any) -> Any:
        await gate
        return _filled(response)

    async def call() -> None:
        timer.cancel()
        answers.append((await client.call_async(Trigger.Request())).message)

    group = ReentrantCallbackGroup()
    client = node.create_client(Trigger, 'greet', callback_group=group)
    node.create_service(Trigger, 'greet', serve, callback_group=group)
    timer = node.create_timer(0.01, call)
    with spinning(executor):
        time.sleep(0.05)
        assert not answers
        gate.set_result(None)
        wait_for(lambda: answers == ['hello'])


def test_hundred_calls_at_once_are_all_answered(node: Any, executor: Any) -> None:
    client = node.create_client(Trigger, 'greet')
    node.create_service(Trigger, 'greet', lambda _, r: _filled(r))
    with spinning(executor):
        assert client.wait_for_service(DEADLINE_SEC)
        calls = [client.call_async(Trigger.Request()) for _ in range(9)]
        wait_for(lambda: all(call.done() for call in calls))


def test_parameter_services_answer(node: Any, executor: Any, context: Context) -> None:
    from rclpy.parameter_client import AsyncParameterClient

    node.declare_parameter('speed', 3)
    asking = rclpy.create_node('asking', context=context)
    executor.add_node(asking)
    client = AsyncParameterClient(asking, 'node')
    with spinning(executor):
        assert client.wait_for_services(DEADLINE_SEC)
        future = client.get_parameters(['speed'])
        wait_for(future.done)
    assert future.result().values[0].integer_value == 3


# timers


def test_a_timer_that_fell_behind_does_not_fire_in_a_burst(node: Any, executor: Any) -> None:
    ticks: list[float] = []

    def tick() -> None:
        ticks.append(time.monotonic())
        if len(ticks) == 1:
            time.sleep(0.5)

    node.create_timer(0.05, tick)
    with spinning(executor):
        wait_for(lambda: len(ticks) >= 6)
    assert ticks[5] - ticks[1] > 0.1


def test_a_timer_can_be_cancelled_reset_and_changed(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    timer = node.create_timer(0.01, lambda: ticks.append(1), autostart=False)
    with spinning(executor):
        time.sleep(0.05)
        assert not ticks
        timer.reset()
        wait_for(lambda: len(ticks) > 2)
        timer.cancel()
        time.sleep(0.03)
        seen = len(ticks)
        time.sleep(0.05)
        assert len(ticks) == seen
        timer.timer_period_ns = 5_000_000
        timer.reset()
        wait_for(lambda: len(ticks) > seen + 3)


def test_a_timer_that_is_always_reset_never_fires(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    timer = node.create_timer(0.5, lambda: ticks.append(1))
    with spinning(executor):
        end = time.monotonic() + 1.2
        while time.monotonic() < end:
            timer.reset()
            time.sleep(0.001)
        assert not ticks
        wait_for(lambda: ticks)


def test_a_timer_follows_simulated_time(context: Context, executor: Any) -> None:
    node = rclpy.create_node(
        'simulated', context=context, parameter_overrides=[Parameter('use_sim_time', value=True)]
    )
    executor.add_node(node)
    ticks: list[int] = []
    node.create_timer(1.0, lambda: ticks.append(node.get_clock().now().nanoseconds))
    publisher = node.create_publisher(Clock, '/clock', 10)

    def publish(sec: int) -> None:
        message = Clock()
        message.clock.sec = sec
        publisher.publish(message)

    with spinning(executor):
        for sec in range(100, 105):
            publish(sec)
            wait_for(lambda sec=sec: node.get_clock().now().nanoseconds == sec * 10**9)
            wait_for(lambda sec=sec: len(ticks) >= min(1, sec - 100))
        time.sleep(0.1)
        seen = len(ticks)
        time.sleep(0.1)
        assert len(ticks) == seen
        assert 3 <= seen <= 5
        node.set_parameters([Parameter('use_sim_time', value=False)])
        wait_for(lambda: len(ticks) > seen)
    node.destroy_node()


def test_timers_of_all_clocks_fire(node: Any, executor: Any) -> None:
    ticks: set[ClockType] = set()
    for kind in (ClockType.STEADY_TIME, ClockType.SYSTEM_TIME, ClockType.ROS_TIME):
        node.create_timer(
            0.01, lambda kind=kind: ticks.add(kind), clock=rclpy.clock.Clock(clock_type=kind)
        )
    with spinning(executor):
        wait_for(lambda: len(ticks) == 3)


def test_a_rate_sleeps_in_a_callback(node: Any, executor: Any) -> None:
    rate = node.create_rate(100)
    slept: list[int] = []

    def sleep() -> None:
        rate.sleep()
        slept.append(1)

    node.create_timer(0.01, sleep, callback_group=MutuallyExclusiveCallbackGroup())
    with spinning(executor):
        wait_for(lambda: len(slept) > 5)


# guard conditions, waitables, QoS events, actions


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
    executor.spin_once(timeout_sec=1)
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

    server = ActionServer(
        node,
        Fibonacci,
        'fibonacci',
        execute_async if asynchronous else execute,
        cancel_callback=lambda _: rclpy.action.CancelResponse.ACCEPT,
    )
    client = ActionClient(node, Fibonacci, 'fibonacci')
    with spinning(executor) as errors:
        assert client.wait_for_server(DEADLINE_SEC)
        sent = [
            client.send_goal_async(
                Fibonacci.Goal(order=5), lambda m: feedback.append(m.feedback.sequence[0])
            )
            for _ in range(3)
        ]
        wait_for(lambda: all(goal.done() for goal in sent))
        results = [goal.result().get_result_async() for goal in sent]
        wait_for(lambda: all(result.done() for result in results))
        assert list(results[0].result().result.sequence) == [0, 1, 2, 3, 4]
        wait_for(lambda: len(feedback) == 15)
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


# cost


@pytest.mark.parametrize('how', ['spin', 'spin_once'])
def test_finished_goals_expire(context: Context, executor: Any, how: str) -> None:
    def execute(goal: Any) -> Any:
        goal.succeed()
        return Fibonacci.Result()

    node = rclpy.create_node('acting', context=context)
    server = ActionServer(node, Fibonacci, 'fibonacci', execute, result_timeout=0.3)
    client = ActionClient(node, Fibonacci, 'fibonacci')
    if how == 'spin':
        executor.add_node(node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def wait_spinning(condition: Callable[[], Any]) -> None:
        if how == 'spin':
            wait_for(condition)
        end = time.monotonic() + DEADLINE_SEC
        while not condition():
            assert time.monotonic() < end
            rclpy.spin_once(node, executor=executor, timeout_sec=0.05)

    sent = client.send_goal_async(Fibonacci.Goal())
    wait_spinning(sent.done)
    result = sent.result().get_result_async()
    wait_spinning(result.done)
    assert server._goal_handles
    wait_spinning(lambda: not server._goal_handles)
    executor.shutdown(5.0)
    node.destroy_node()


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
