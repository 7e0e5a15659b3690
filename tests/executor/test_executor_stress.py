"""Nodes and entities come and go in many threads while messages flow; nothing hangs or is lost."""

import os
import random
import threading
import time
import traceback
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.type_support import check_for_type_support
from spinning import DEADLINE_SEC
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(300, method='thread'),
    # rclpy says so of clients that are gone before they are answered, as many are here.
    pytest.mark.filterwarnings('ignore:failed to send response:RuntimeWarning'),
    # rclpy notes a goal's future after its request is sent: an answer may be quicker.
    pytest.mark.filterwarnings('ignore:Unhandled exception in done callback.*not in list'),
]
STRESS_SEC = float(os.environ.get('COMPOSER_STRESS_SEC', '2'))


class Churn:
    """One thread's way to make and destroy things at random."""

    def __init__(self, number: int, context: Context, executor: Any) -> None:
        self.random = random.Random(number)
        self.context = context
        self.executor = executor
        self.name = f'churn_{number}'
        self.rounds = 0
        self.error = ''

    def run(self, end: float) -> None:
        try:
            while time.monotonic() < end:
                self.round()
                self.rounds += 1
        except BaseException:  # noqa: BLE001
            self.error = traceback.format_exc()

    def round(self) -> None:
        node = rclpy.create_node(self.name, context=self.context, enable_rosout=False)
        if self.random.random() < 0.5:
            self.executor.add_node(node)
        publisher = node.create_publisher(Int32, 'shared', 10)
        made = [self.create(node) for _ in range(self.random.randrange(6))]
        self.executor.add_node(node)
        for number in range(self.random.randrange(20)):
            publisher.publish(Int32(data=number))
        time.sleep(self.random.random() * 0.01)
        self.random.shuffle(made)
        for destroy in made[: self.random.randrange(len(made) + 1)]:
            destroy()
        if self.random.random() < 0.5:
            self.executor.remove_node(node)
        node.destroy_node()
        self.executor.remove_node(node)

    def create(self, node: Any) -> Any:
        group = self.random.choice(
            (None, MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup())
        )
        kind = self.random.randrange(6)
        if kind == 0:
            entity = node.create_timer(0.001, self.work, callback_group=group)
            return lambda: node.destroy_timer(entity)
        if kind == 1:
            entity = node.create_subscription(Int32, 'shared', self.take, 10, callback_group=group)
            return lambda: node.destroy_subscription(entity)
        if kind == 2:
            entity = node.create_service(
                Trigger, f'{self.name}/serve', lambda _, r: r, callback_group=group
            )
            return lambda: node.destroy_service(entity)
        if kind == 3:
            entity = node.create_client(Trigger, f'{self.name}/serve', callback_group=group)
            entity.call_async(Trigger.Request())
            return lambda: node.destroy_client(entity)
        if kind == 4:
            entity = node.create_guard_condition(self.work, callback_group=group)
            entity.trigger()
            return lambda: node.destroy_guard_condition(entity)
        server = ActionServer(node, Fibonacci, f'{self.name}/act', self.act, callback_group=group)
        client = ActionClient(node, Fibonacci, f'{self.name}/act', callback_group=group)
        client.send_goal_async(Fibonacci.Goal(order=1))
        return lambda: (client.destroy(), server.destroy())

    def work(self) -> None:
        if self.random.random() < 0.1:
            time.sleep(0.003)

    async def take(self, _: Int32) -> None:
        self.work()

    def act(self, goal: Any) -> Any:
        goal.succeed()
        return Fibonacci.Result()


def test_messages_flow_while_everything_comes_and_goes(
    context: Context,
    executor: Any,
) -> None:
    for kind in (Int32, Trigger, Fibonacci):
        check_for_type_support(kind)  # Which is not safe in several threads at once.
    steady = rclpy.create_node('steady', context=context)
    executor.add_node(steady)
    got: list[int] = []
    sent = 0
    steady.create_subscription(
        Int32,
        'steady',
        lambda m: got.append(m.data),
        1000,
        callback_group=MutuallyExclusiveCallbackGroup(),
    )
    publisher = steady.create_publisher(Int32, 'steady', 1000)

    def publish() -> None:
        nonlocal sent
        publisher.publish(Int32(data=sent))
        sent += 1

    steady.create_timer(0.005, publish, callback_group=MutuallyExclusiveCallbackGroup())
    end = time.monotonic() + STRESS_SEC
    errors: list[BaseException] = []

    def spin() -> None:
        while (
            time.monotonic() < end + DEADLINE_SEC and executor.context.ok() and not over.is_set()
        ):
            try:
                executor.spin()
            except (InvalidHandle, KeyError, RuntimeError) as error:
                errors.append(error)  # A callback of what was being destroyed.

    over = threading.Event()
    spinner = threading.Thread(target=spin, daemon=True)
    spinner.start()
    churns = [Churn(number, context, executor) for number in range(4)]
    threads = [threading.Thread(target=churn.run, args=(end,), daemon=True) for churn in churns]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(STRESS_SEC + DEADLINE_SEC)
        assert not thread.is_alive()
    assert ''.join(churn.error for churn in churns) == ''
    assert all(churn.rounds for churn in churns)
    deadline = time.monotonic() + DEADLINE_SEC
    while len(got) < sent and time.monotonic() < deadline:
        time.sleep(0.01)
    over.set()
    assert executor.shutdown(DEADLINE_SEC)
    spinner.join(DEADLINE_SEC)
    assert not spinner.is_alive()
    assert sent > 10
    assert got[:sent] == list(range(len(got[:sent])))
    assert len(got) >= sent - 1
