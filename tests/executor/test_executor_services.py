"""Services and their clients."""

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
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from composer.executor import ComposerExecutor

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(300, method='thread'),
    pytest.mark.usefixtures('patient'),
]


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


def test_calls_at_once_are_all_answered(node: Any, executor: Any) -> None:
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


def test_messages_are_taken_before_responses_as_rclpy_does(
    node: Any, executor: Any, context: Context
) -> None:
    got: list[int] = []
    client = node.create_client(Trigger, 'greet')
    node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 10)
    executor.spin_once(timeout_sec=0)
    other = rclpy.create_node('other', context=context)
    answered: list[int] = []
    other.create_service(Trigger, 'greet', lambda _, r: (answered.append(1), r)[1])
    with spinning(ComposerExecutor(context=context)) as _:
        assert client.wait_for_service(DEADLINE_SEC)
    server = ComposerExecutor(context=context)
    server.add_node(other)
    future = client.call_async(Trigger.Request())
    wait_for(lambda: server.spin_once(timeout_sec=0) or answered)
    other.create_publisher(Int32, 'count', 10).publish(Int32(data=1))
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert got == [1]
    assert not future.done()
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    assert future.done()
    server.shutdown()


def test_what_a_service_has_a_task_publish_comes_before_its_response(
    node: Any, executor: Any
) -> None:
    heard: list[str] = []
    node.create_subscription(Int32, 'count', lambda _: heard.append('message'), 10)
    publisher = node.create_publisher(Int32, 'count', 10)

    def serve(_: Any, response: Any) -> Any:
        executor.create_task(publisher.publish, Int32())
        return response

    node.create_service(Trigger, 'greet', serve)
    client = node.create_client(Trigger, 'greet')
    with spinning(executor):
        assert client.wait_for_service(DEADLINE_SEC)
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda _: heard.append('response'))
        wait_for(lambda: len(heard) == 2)
    assert heard == ['message', 'response']


def test_a_response_waits_for_a_message_that_came_after_the_last_look(
    node: Any, executor: Any
) -> None:
    heard: list[str] = []
    client = node.create_client(Trigger, 'greet')
    node.create_subscription(Int32, 'count', lambda _: heard.append('message'), 10)
    publisher = node.create_publisher(Int32, 'count', 10)
    node.create_service(Trigger, 'greet', lambda _, r: r)
    executor.spin_once(timeout_sec=0)
    assert client.wait_for_service(DEADLINE_SEC)
    future = client.call_async(Trigger.Request())
    future.add_done_callback(lambda _: heard.append('response'))
    executor.spin_once(timeout_sec=DEADLINE_SEC)
    wait_for(executor._engine.polling.peek)
    publisher.publish(Int32())
    executor.spin_until_future_complete(future, timeout_sec=DEADLINE_SEC)
    wait_for(lambda: executor.spin_once(timeout_sec=0) or 'response' in heard)
    assert heard == ['message', 'response']
