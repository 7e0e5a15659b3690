"""`shutdown`, `wake`, contexts and signals."""

import gc
import signal
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.context import Context
from rclpy.executors import ShutdownException
from rclpy.task import Future
from spinning import DEADLINE_SEC, spinning, wait_for, wait_until_quiet

from composer.executor import ComposerExecutor
from composer.executor.spinner import Notifier

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


def test_wait_for_ready_callbacks_raises_after_shutdown(executor: Any) -> None:
    executor.shutdown()
    with pytest.raises(ShutdownException):
        executor.wait_for_ready_callbacks()


@pytest.mark.parametrize('wait_for_threads', [True, False])
def test_shutdown_waits_for_a_callback_and_reports_a_stuck_one(
    node: Any,
    executor: Any,
    wait_for_threads: bool,  # noqa: FBT001
) -> None:
    let_go = threading.Event()
    began = threading.Event()
    node.create_timer(0.01, lambda: (began.set(), let_go.wait(DEADLINE_SEC)))
    thread = threading.Thread(target=executor.spin)
    thread.start()
    assert began.wait(DEADLINE_SEC)
    assert not executor.shutdown(timeout_sec=0.05, wait_for_threads=wait_for_threads)
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    let_go.set()
    assert executor.shutdown(wait_for_threads=wait_for_threads)


def test_callbacks_that_all_shut_down_wait_for_none_of_them(node: Any, executor: Any) -> None:
    together = threading.Barrier(3)
    results: list[bool] = []

    def shut_down() -> None:
        together.wait(DEADLINE_SEC)
        results.append(executor.shutdown())
        together.wait(DEADLINE_SEC)

    for _ in range(3):
        node.create_timer(0.01, shut_down, callback_group=MutuallyExclusiveCallbackGroup())
    executor.spin()
    wait_for(lambda: results == [True] * 3)
    assert executor.shutdown()


def test_many_threads_may_shut_down_at_once(context: Context) -> None:
    errors: list[BaseException] = []

    def shut_down(executor: Any) -> None:
        try:
            assert executor.shutdown(DEADLINE_SEC)
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    for _ in range(20):
        executor = ComposerExecutor(context=context)
        executor.spin_once(timeout_sec=0)
        threads = [threading.Thread(target=shut_down, args=(executor,)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(DEADLINE_SEC)
    assert errors == []


def test_shutdown_waits_for_a_callback_when_the_context_has_ended(
    node: Any, executor: Any, context: Context
) -> None:
    began, let_go = threading.Event(), threading.Event()
    ended: list[int] = []

    def block() -> None:
        began.set()
        let_go.wait(DEADLINE_SEC)
        ended.append(1)

    node.create_timer(0.01, block)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    assert began.wait(DEADLINE_SEC)
    context.shutdown()
    thread.join(DEADLINE_SEC)
    threading.Timer(0.2, let_go.set).start()
    assert executor.shutdown()
    assert ended


@pytest.mark.usefixtures('domain_id')
def test_callbacks_under_way_end_before_the_interpreter_does(start_program: Any) -> None:
    program = """
import rclpy, threading, time
from rclpy.callback_groups import ReentrantCallbackGroup
from composer.executor import ComposerExecutor
rclpy.init()
executor = ComposerExecutor()
began = threading.Semaphore(0)
def work(number):
    began.release()
    time.sleep(0.5)
    print(f'{number} ', end='', flush=True)
for number in range(20):
    executor.create_task(work, number)
threading.Thread(target=executor.spin, daemon=True).start()
for _ in range(20):
    began.acquire()
"""
    process = start_program('-c', program)
    output, _ = process.communicate(timeout=DEADLINE_SEC)
    assert sorted(map(int, output.split())) == list(range(20))
    assert process.returncode == 0


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
    while not ticks:
        executor.spin_until_future_complete(Future(), timeout_sec=0.1)
    wait_until_quiet(ticks)


@pytest.mark.parametrize(
    ('name', 'how'),
    [
        ('SIGTERM', 'spin'),
        *(('SIGINT', how) for how in ('spin_once', 'busy', 'sent', 'handed over')),
    ],
)
@pytest.mark.usefixtures('domain_id')
def test_signals_end_spin(name: str, how: str, start_program: Any) -> None:
    """Whatever goes on: short callbacks, or messages without an end, sent or handed over."""
    program = f"""
import rclpy, time
from std_msgs.msg import Empty
from composer.executor import ComposerExecutor
from composer.executor.c_bindings import Readiness
from composer.executor.spinner import Notifier
rclpy.init()
node = rclpy.create_node('node')
executor = ComposerExecutor()
executor.add_node(node)
if {how!r} == 'busy':
    node.create_timer(0.001, lambda: time.sleep(0.0005))
if {how!r} in ('sent', 'handed over'):
    subscription = node.create_subscription(Empty, 'endless', lambda m: send(m), 10)
    inbox = executor.open_inbox(node, subscription, 10)
    publisher = node.create_publisher(Empty, 'endless', 10)
    send = publisher.publish if {how!r} == 'sent' else inbox.put
    for _ in range(5):
        send(Empty())
executor.create_task(print, 'spinning', flush=True)
try:
    rclpy.spin(node, executor) if {how!r} == 'spin_once' else executor.spin()
    print('returned', flush=True)
except KeyboardInterrupt:
    print('interrupted', flush=True)
"""
    process = start_program('-c', program)
    assert process.stdout.readline() == 'spinning\n'
    process.send_signal(getattr(signal, name))
    output, _ = process.communicate(timeout=DEADLINE_SEC)
    assert output in ('interrupted\n', 'returned\n')
    assert process.returncode == 0


def test_a_wait_may_be_interrupted_at_any_point() -> None:
    def count_points() -> int:
        notifier = Notifier()
        point = 0
        while interrupt_at(point, lambda: notifier.wait_for(lambda: False, 0.001)):
            point += 1
            notifier.notify()
            assert notifier.wait_for(lambda: True, None)
        return point

    # What is raised between two opcodes may stay in `sys.exc_info` for as long as the thread lives.
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(count_points).result() > 20


def interrupt_at(point: int, function: Callable[[], Any]) -> bool:
    """Raise KeyboardInterrupt at a point of what runs; return whether there are so many."""
    points = count()

    def trace(frame: Any, event: str, _: Any) -> Any:
        frame.f_trace_opcodes = True
        if event == 'opcode' and next(points) == point:
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    gc.disable()  # What it calls would swallow the error.
    sys.settrace(trace)
    try:
        function()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
        gc.enable()
    return False


def test_spin_ends_when_a_signal_ends_the_context_after_it_woke_the_executor(
    executor: Any, context: Context, monkeypatch: Any
) -> None:
    wait_set_thread = executor._spinner.wait_set_thread
    waits: list[int] = []
    wait = wait_set_thread._wait

    def count_and_wait(max_sec: float | None) -> None:
        waits.append(1)
        wait(max_sec)

    monkeypatch.setattr(wait_set_thread, '_wait', count_and_wait)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    wait_for(lambda: waits)
    wait_until_quiet(waits)
    seen = len(waits)
    # As rclpy's thread for signals does it: first this, then, when it runs again, that.
    executor._sigint_gc.trigger()
    wait_for(lambda: len(waits) > seen)
    context.handle.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


@pytest.mark.parametrize('what', ['context', 'executor'])
def test_spin_once_ends_when_the_context_or_executor_ended_right_before_it_waits(
    node: Any, executor: Any, context: Context, monkeypatch: Any, what: str
) -> None:
    spinner = executor._spinner
    wait_if = spinner.poller.wait_if

    def wait_later(*arguments: Any) -> None:
        if what == 'context':
            context.handle.shutdown()
            spinner.wake()
        else:
            executor.shutdown(0)
        wait_if(*arguments)

    monkeypatch.setattr(spinner.poller, 'wait_if', wait_later)
    thread = threading.Thread(target=executor.spin_once, daemon=True)
    thread.start()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


def test_two_executors_of_two_contexts_do_not_meet(
    executor: Any, node: Any, other_domain_id: int
) -> None:
    other = Context()
    rclpy.init(context=other, domain_id=other_domain_id)
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


@pytest.mark.parametrize('how', ['spin', 'spin_once', 'spin_until_future_complete'])
def test_executors_can_be_shut_down_as_soon_as_they_are_spun(context: Context, how: str) -> None:
    errors: list[BaseException] = []
    node = rclpy.create_node('node', context=context)
    node.create_timer(0.0005, lambda: None)

    def spin() -> None:
        try:
            while not executor._is_shutdown:
                if how == 'spin_until_future_complete':
                    executor.spin_until_future_complete(Future(), timeout_sec=0.001)
                else:
                    getattr(executor, how)()
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    for number in range(40):
        executor = ComposerExecutor(context=context)
        executor.add_node(node)
        thread = threading.Thread(target=spin)
        thread.start()
        time.sleep(number * 0.0001)
        assert executor.shutdown()
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive()
    assert errors == []
