"""An executor that nobody refers to any more is freed, with its threads and descriptors."""

import gc
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')

import rclpy
from rclpy.context import Context
from rclpy.task import Future
from spinning import DEADLINE_SEC, wait_for
from std_msgs.msg import Empty

from composer.executor import ComposerExecutor, composer_executor

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


def spin_in_a_thread(executor: Any, node: Any) -> None:
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin_once, args=(0.01,))
    thread.start()
    thread.join(DEADLINE_SEC)


def leave_a_callback(executor: Any, node: Any) -> None:
    """It is still running when the executor goes."""
    executor.create_task(time.sleep, 0.2)
    executor.spin_once()


def raise_in_a_callback(executor: Any, node: Any) -> None:
    node.create_timer(0.001, lambda: int('x'))
    executor.add_node(node)
    with suppress(ValueError):
        executor.spin()


def await_for_ever(executor: Any, node: Any) -> None:
    async def wait() -> None:
        await Future()

    executor.create_task(wait)
    executor.spin_once(0)


WAYS: dict[str, Callable[[Any, Any], Any]] = {
    'spun with a node': lambda executor, node: rclpy.spin_once(node, executor=executor),
    'spun in a thread': spin_in_a_thread,
    'a callback is left': leave_a_callback,
    'an error': raise_in_a_callback,
    'a coroutine waits': await_for_ever,
    'not all have ended': lambda executor, node: executor.shutdown(0, wait_for_threads=False),
}


def held() -> list[str]:
    """Return what executors have of the system."""
    descriptors = []
    for each in Path('/proc/self/fd').iterdir():
        with suppress(FileNotFoundError):
            descriptors.append(str(each.readlink()))
    threads = [each.name for each in threading.enumerate()]
    return sorted(
        [each for each in descriptors if each.startswith('anon_inode')]
        + [each for each in threads if each.startswith('executor-')]
    )


@pytest.fixture
def no_collection() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures('no_collection')
def test_a_dropped_executor_leaves_nothing_without_the_garbage_collector(domain_id: int) -> None:
    before = held()
    for use in WAYS.values():
        context = Context()
        rclpy.init(context=context, domain_id=domain_id)
        node = rclpy.create_node('node', context=context)
        node.create_subscription(Empty, 'topic', print, 10)
        node.create_timer(0.001, int)
        node.create_guard_condition(int)
        executor = ComposerExecutor(context=context)
        use(executor, node)
        gone = weakref.ref(executor)
        del executor
        wait_for(lambda gone=gone: gone() is None)
        node.destroy_node()
        context.try_shutdown()
        wait_for(lambda: held() == before)


def test_one_that_its_callbacks_refer_to_is_freed_by_the_garbage_collector(
    context: Context,
) -> None:
    before = held()
    executor: Any = ComposerExecutor(context=context)
    node = rclpy.create_node('node', context=context)
    node.create_timer(0.001, lambda executor=executor: executor.wake())
    executor.add_node(node)
    executor.spin_once(1)
    gone = weakref.ref(executor)
    del executor, node

    def is_gone() -> bool:
        gc.collect()
        return gone() is None and held() == before

    wait_for(is_gone)


def test_many_that_refer_to_themselves_do_not_use_up_the_descriptors(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What other tests of this process held may have raised it.
    monkeypatch.setattr(composer_executor, '_most_executors', 32)
    before = len(held())
    for _ in range(150):
        executor: Any = ComposerExecutor(context=context)
        executor.itself = executor
        executor.spin_once(0)
        # Three each, of a hundred; without the collection it would come to 450.
        assert len(held()) - before < 400


def test_a_node_goes_on_in_another_executor_after_its_own_was_dropped(context: Context) -> None:
    heard: list[Any] = []
    node = rclpy.create_node('node', context=context)
    publisher = node.create_publisher(Empty, 'topic', 10)
    node.create_subscription(Empty, 'topic', heard.append, 10)
    guard = node.create_guard_condition(lambda: heard.append('guard'))
    for number in range(1, 20):
        executor: Any = ComposerExecutor(context=context)  # The one before is dropped here.
        executor.add_node(node)
        publisher.publish(Empty())
        guard.trigger()
        end = time.monotonic() + DEADLINE_SEC
        while len(heard) < 2 * number and time.monotonic() < end:
            executor.spin_once(0.5)
        assert len(heard) == 2 * number
    node.destroy_node()


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('threads', [None, 1])
def test_any_number_of_threads_goes_without_a_warning(
    context: Context, threads: int | None
) -> None:
    assert ComposerExecutor(threads, context=context).shutdown()


def test_no_thread_at_all_is_refused_as_by_rclpy(context: Context) -> None:
    with pytest.raises(ValueError, match='max_workers must be greater than 0'):
        ComposerExecutor(0, context=context)
