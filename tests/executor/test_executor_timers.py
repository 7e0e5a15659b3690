"""Timers of all clocks."""

import time
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import ClockType
from rclpy.context import Context
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from spinning import spinning, wait_for, wait_until_quiet

# A thread watches over the time: a deadlock outside of Python hears no signal.
pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


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
        wait_until_quiet(ticks)
        seen = len(ticks)
        timer.timer_period_ns = 5_000_000
        timer.reset()
        wait_for(lambda: len(ticks) > seen + 3)


def stays_silent(timer: Any, ticks: list[int]) -> bool:
    """Reset a timer all the time; return whether no reset was so late that it may have fired."""
    timer.cancel()
    wait_until_quiet(ticks)
    ticks.clear()
    begun = last = time.monotonic()
    while last < begun + 1.2:
        timer.reset()
        time.sleep(0.001)
        now = time.monotonic()
        if now - last > 0.2:
            return False
        last = now
    assert not ticks
    return True


def test_a_timer_that_is_always_reset_never_fires(node: Any, executor: Any) -> None:
    ticks: list[int] = []
    timer = node.create_timer(0.5, lambda: ticks.append(1))
    with spinning(executor):
        wait_for(lambda: stays_silent(timer, ticks))
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
            wait_for(lambda sec=sec: sec == 100 or sec * 10**9 in ticks)
        wait_until_quiet(ticks)
        seen = len(ticks)
        assert 4 <= seen <= 5
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
