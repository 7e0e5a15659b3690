"""`spin`, `spin_once` and the like keep rclpy's promises."""

import _thread
import asyncio
import concurrent.futures
import sys
import threading
import time
from contextlib import nullcontext
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.context import Context
from rclpy.task import Future
from spinning import DEADLINE_SEC, spinning, wait_for, wait_until_quiet

from composer.executor import ComposerExecutor

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


@pytest.mark.usefixtures('patient')
def test_spin_once_runs_one_callback(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    node.create_timer(0.01, lambda: ticks.append(1))
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert ticks == [1]


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
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert not over.is_set()
    let_go.set()
    assert over.wait(DEADLINE_SEC)


@pytest.mark.usefixtures('patient')
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


@pytest.mark.parametrize('how', ['spin_until', 'spin_once_until'])
def test_futures_that_compute_whether_they_are_done_are_asked_after_callbacks(
    node: Any, executor: Any, how: str
) -> None:
    ticks: list[int] = []

    class ThirdTick(Future):
        def done(self) -> bool:
            return len(ticks) > 2

    node.create_timer(0.01, lambda: ticks.append(1))
    future = ThirdTick()
    while not future.done():
        getattr(executor, f'{how}_future_complete')(future, DEADLINE_SEC)
        assert how == 'spin_once_until' or future.done()


def test_spin_until_future_complete_takes_futures_of_the_standard_library(
    node: Any, executor: Any
) -> None:
    future: concurrent.futures.Future[int] = concurrent.futures.Future()
    threading.Timer(0.05, future.set_result, (5,)).start()
    executor.spin_until_future_complete(future)
    assert future.result() == 5
    executor.spin_until_future_complete(future, timeout_sec=0)


@pytest.mark.usefixtures('patient')
def test_rclpy_functions_take_the_executor(context: Any, executor: Any) -> None:
    node = rclpy.create_node('given', context=context)
    future = Future()
    ticks: list[int] = []

    def tick() -> None:
        ticks.append(1)
        if len(ticks) > 2:
            future.set_result(None)

    node.create_timer(0.01, tick)
    rclpy.spin_once(node, executor=executor, timeout_sec=DEADLINE_SEC)
    assert len(ticks) == 1
    rclpy.spin_until_future_complete(node, future, executor, DEADLINE_SEC)
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


@pytest.mark.usefixtures('patient')
def test_spin_once_raises_what_a_callback_raises(node: Any, executor: Any) -> None:
    def fail() -> None:
        raise KeyError

    node.create_timer(0.01, fail)
    with pytest.raises(KeyError):
        executor.spin_once(timeout_sec=DEADLINE_SEC)


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


def test_system_exit_in_a_callback_is_raised_from_spin(node: Any, executor: Any) -> None:
    node.create_timer(0.01, lambda: sys.exit(3))
    with pytest.raises(SystemExit):
        executor.spin()


def test_spin_once_waits_for_less_than_a_millisecond_if_told_so(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    node.create_timer(0.02, lambda: ticks.append(1))
    executor.spin_once(timeout_sec=DEADLINE_SEC)

    def waits_between_two_ticks() -> int:
        seen, waits = len(ticks), 0
        while len(ticks) == seen:
            executor.spin_once(timeout_sec=0.0002)
            waits += 1
        return waits

    # Waits of whole milliseconds would be 20 at most.
    wait_for(lambda: waits_between_two_ticks() > 25)


@pytest.mark.parametrize('beside_spin', [False, True])
def test_each_of_many_threads_that_spin_once_gets_a_callback(
    executor: Any, *, beside_spin: bool
) -> None:
    ran: list[int] = []

    def spin_once() -> None:
        for _ in range(20):
            executor.spin_once()

    threads = [threading.Thread(target=spin_once, daemon=True) for _ in range(10)]
    with spinning(executor) if beside_spin else nullcontext():
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            executor.create_task(ran.append, 1)
            time.sleep(0.0005)
        for thread in threads:
            thread.join()
    assert len(ran) >= (0 if beside_spin else 200)


def test_threads_that_spin_once_run_no_more_callbacks_than_they_are(executor: Any) -> None:
    ran: list[int] = []
    for number in range(100):
        executor.create_task(ran.append, number)
    threads = [
        threading.Thread(target=executor.spin_once, args=(DEADLINE_SEC,)) for _ in range(10)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(DEADLINE_SEC)
    wait_until_quiet(ran)
    assert len(ran) == 10


def test_threads_that_spin_once_end_with_the_context(
    node: Any, executor: Any, context: Context
) -> None:
    threads = [threading.Thread(target=executor.spin_once, daemon=True) for _ in range(10)]
    for thread in threads:
        thread.start()
    wait_for(lambda: len(executor._spinner.scheduler._admitting) == 10)
    context.shutdown()
    for thread in threads:
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()


@pytest.mark.parametrize(
    ('module', 'name', 'how'),
    [
        (_thread, 'start_new_thread', 'spin'),
        (threading, '_start_new_thread', 'spin_once'),
        (threading, '_start_new_thread', 'spin_until_future_complete'),
    ],
)
def test_what_finds_no_thread_raises_and_leaves_nothing_behind(
    node: Any, executor: Any, monkeypatch: Any, module: Any, name: str, how: str
) -> None:
    def refuse(*_: Any) -> None:
        message = "can't start new thread"
        raise RuntimeError(message)

    ticks: list[int] = []
    node.create_timer(0.001, lambda: ticks.append(1))
    arguments = (Future(),) if how == 'spin_until_future_complete' else ()
    with monkeypatch.context() as patch:
        patch.setattr(module, name, refuse)
        with pytest.raises(RuntimeError, match='new thread'):
            getattr(executor, how)(*arguments)
    assert not executor._spinner.scheduler.is_spinning
    assert not ticks
    executor.spin_once()
    assert ticks


@pytest.mark.filterwarnings('ignore:MultiThreadedExecutor is used with a single thread')
def test_a_callback_may_spin_though_there_is_one_thread(context: Context) -> None:
    executor = ComposerExecutor(num_threads=1, context=context)
    results: list[int] = []

    def outer() -> None:
        inner = executor.create_task(lambda: 3)
        executor.spin_until_future_complete(inner, DEADLINE_SEC)
        results.append(inner.result())
        executor.create_task(results.append, 4)
        executor.spin_once(DEADLINE_SEC)

    executor.spin_until_future_complete(executor.create_task(outer), DEADLINE_SEC)
    assert results == [3, 4]
    executor.shutdown()


def test_a_subclass_may_say_what_is_executed(context: Context) -> None:
    class Picky(ComposerExecutor):
        open_to: Any = None

        def can_execute(self, entity: Any) -> bool:
            return entity is self.open_to and super().can_execute(entity)

    executor = Picky(context=context)
    node = rclpy.create_node('node', context=context)
    ticks: list[int] = []
    for number in range(2):
        node.create_timer(0.01, lambda number=number: ticks.append(number))
    guard = node.create_guard_condition(lambda: ticks.append(2))
    executor.add_node(node)
    with spinning(executor):
        executor.open_to = list(node.timers)[1]
        wait_for(lambda: len(ticks) > 3)
        assert set(ticks) == {1}
        executor.open_to = guard
        guard.trigger()
        wait_for(lambda: 2 in ticks)


def test_a_subclass_is_told_that_its_takes_are_never_called() -> None:
    with pytest.warns(UserWarning, match='Taking._take_timer is never called'):

        class Taking(ComposerExecutor):
            def _take_timer(self, tmr: Any) -> Any:
                return super()._take_timer(tmr)


def test_an_rclpy_that_is_too_old_is_called_that(start_program: Any) -> None:
    program = """
import rclpy.executors
from composer.errors import ComposerError
del rclpy.executors.TimeoutObject
try:
    import composer.executor
except ComposerError as error:
    print(error)
"""
    output, _ = start_program('-c', program).communicate(timeout=DEADLINE_SEC)
    assert output.startswith('the executor needs rclpy 7.1 (ROS 2 Jazzy) or newer')
