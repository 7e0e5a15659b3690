"""Messages without an end: whoever spins gets through, and so does everybody else."""

import threading
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

from rclpy.task import Future
from spinning import DEADLINE_SEC, spinning, wait_for
from std_msgs.msg import Empty, String

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


@pytest.fixture(params=['sent', 'handed over'])
def endless(request: Any, node: Any, executor: Any) -> list[int]:
    """Messages that each cause the next; the list grows with them."""
    got: list[int] = []

    def answer(message: Empty) -> None:
        got.append(1)
        send(message)

    subscription = node.create_subscription(Empty, 'endless', answer, 10)
    send = node.create_publisher(Empty, 'endless', 10).publish
    if request.param == 'handed over':
        send = executor.open_inbox(node, subscription, 10).put
    for _ in range(5):
        send(Empty())
    return got


def test_timers_tasks_and_others_run_beside_endless_messages(
    node: Any, executor: Any, endless: list[int]
) -> None:
    ticks: list[int] = []
    others: list[int] = []
    node.create_timer(0.001, lambda: ticks.append(1))
    node.create_subscription(Empty, 'other', lambda _: others.append(1), 10)
    publisher = node.create_publisher(Empty, 'other', 10)
    with spinning(executor):
        wait_for(lambda: len(ticks) > 20)
        publisher.publish(Empty())
        wait_for(lambda: others)
        done = executor.create_task(lambda: 1)
        wait_for(done.done)
    assert endless


def test_whoever_spins_returns_beside_endless_messages(
    node: Any, executor: Any, endless: list[int]
) -> None:
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert endless
    executor.spin_until_future_complete(Future(), timeout_sec=0.05)
    done: Any = Future()
    threading.Timer(0.05, lambda: done.set_result(1)).start()
    executor.spin_until_future_complete(done, DEADLINE_SEC)
    assert done.done()


def test_shutdown_ends_endless_messages(node: Any, executor: Any, endless: list[int]) -> None:
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    wait_for(lambda: len(endless) > 100)
    assert executor.shutdown(DEADLINE_SEC)
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()


def test_one_queue_holds_what_was_sent_and_what_was_handed_over(node: Any, executor: Any) -> None:
    """Together no more than the depth; the oldest of those handed over make room."""
    got: list[str] = []
    publisher = node.create_publisher(String, 'both', 10)
    subscription = node.create_subscription(String, 'both', lambda m: got.append(m.data), 5)
    inbox = executor.open_inbox(node, subscription, 5)
    wait_for(publisher.get_subscription_count)
    executor.spin_once(timeout_sec=0)  # From now on it is known what the middleware has.
    for number in range(4):
        inbox.put(String(data=f'local {number}'))
    for number in range(3):
        publisher.publish(String(data=f'sent {number}'))
    while len(got) < 5:
        executor.spin_once(timeout_sec=DEADLINE_SEC)
    executor.spin_once(timeout_sec=0)
    assert got == ['local 2', 'local 3', 'sent 0', 'sent 1', 'sent 2']
    assert inbox.overruns == 2
