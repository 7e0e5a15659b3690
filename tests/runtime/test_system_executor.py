"""What a system asks of its executor beyond rclpy's promises."""

import threading

import pytest

pytest.importorskip('rclpy')

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from composer.runtime.nodes.callback_groups import (
    Gate,
    GatedMutuallyExclusiveGroup,
)
from composer.runtime.stop_request import StopRequest
from composer.runtime.system_executor import SystemExecutor

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]
DEADLINE_SEC = 90.0


@pytest.fixture
def system_executor(context, node):
    logged = []
    executor = SystemExecutor(context, 1, logged.append)
    executor.logged = logged
    node.executor.remove_node(node)
    executor.add_node(node)
    executor.start()
    yield executor
    assert executor.stop(DEADLINE_SEC)


def test_a_closed_gate_keeps_ticks_until_it_opens_and_the_executor_is_woken(
    system_executor, node, wait_for
):
    gate = Gate(StopRequest())
    ticks, others = [], []
    node.create_timer(
        0.01, lambda: ticks.append(1), callback_group=GatedMutuallyExclusiveGroup(gate)
    )
    node.create_timer(0.01, lambda: others.append(1))
    wait_for(lambda: len(others) > 5, 'ticks of the timer without a gate')
    assert not ticks

    gate.open()
    system_executor.wake()

    wait_for(lambda: len(ticks) > 5, 'ticks behind the gate')


def test_as_many_callbacks_run_at_a_time_as_there_may_be_now(system_executor, node, wait_for):
    inside, most = [], []
    running = system_executor._spinner.scheduler

    def enter():
        inside.append(1)
        most.append(len(inside))
        threading.Event().wait(0.005)
        inside.pop()

    for _ in range(5):
        node.create_timer(0.001, enter, callback_group=MutuallyExclusiveCallbackGroup())

    wait_for(lambda: len(most) > 20, 'callbacks')
    assert max(most) == 1
    for threads in (3, 2, None):
        system_executor.limit_threads(threads)
        # One that has begun may not have entered yet.
        wait_for(lambda: running.running <= (threads or 5), 'the end of those that were more')  # noqa: B023
        most.clear()
        wait_for(lambda: len(most) > 50, 'callbacks')
        assert max(most) == (threads or 5)


def test_a_finding_is_logged_once_and_dispatching_goes_on(system_executor, node, wait_for):
    ticks = []

    def fail():
        failing.cancel()
        raise ValueError

    failing = node.create_timer(0.01, fail)
    node.create_timer(0.01, lambda: ticks.append(1))

    wait_for(lambda: len(ticks) > 5, 'ticks after the finding')
    assert len(system_executor.logged) == 1
    assert system_executor.logged[0].endswith('ValueError')
