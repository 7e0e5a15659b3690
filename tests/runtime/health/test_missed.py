"""What subscriptions and timers miss because callbacks take too long is counted exactly."""

import threading
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy')

from rclpy.clock import ROSClock
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from std_msgs.msg import Int32

from composer.runtime.health.missed import MissedCounts, count_missed
from tests.running import DEADLINE_SEC

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300, method='thread')]


@contextmanager
def spinning(executor):
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        yield
    finally:
        executor.shutdown(DEADLINE_SEC)
        thread.join()


class Slow:
    """A subscription whose callback waits until it is let go."""

    def __init__(self, node, reliability='RELIABLE'):
        self.heard = []
        self.may_end = threading.Event()
        profile = QoSProfile(depth=10, reliability=ReliabilityPolicy[reliability])
        self.entity = node.create_subscription(Int32, 'numbers', self.hear, profile)

    def hear(self, message):
        self.heard.append(message.data)
        self.may_end.wait(60.0)


def advertise(node, reliability, wait_for):
    qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy[reliability])
    publisher = node.create_publisher(Int32, 'numbers', qos)
    wait_for(publisher.get_subscription_count, 'the subscription')
    return publisher


@pytest.mark.parametrize('reliability', ['RELIABLE', 'BEST_EFFORT'])
def test_messages_that_a_full_queue_drops_are_overruns(node, executor, wait_for, reliability):
    slow = Slow(node, reliability)
    missed = count_missed(executor, node, slow.entity)
    publisher = advertise(node, reliability, wait_for)
    with spinning(executor):
        publisher.publish(Int32(data=-1))
        wait_for(lambda: slow.heard, 'the first message')
        for number in range(100):
            publisher.publish(Int32(data=number))
        wait_for(lambda: missed() == MissedCounts(overruns=90), 'overruns of the full queue')
        slow.may_end.set()
        wait_for(lambda: slow.heard == [-1, *range(90, 100)], 'what was kept')
        assert missed() == MissedCounts(overruns=90)


def test_a_clock_that_leaps_over_ticks_skips_them(node, executor, wait_for):
    clock = ROSClock()
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(seconds=100))
    ticks = []
    timer = node.create_timer(
        1.0, lambda: ticks.append(clock.now().nanoseconds / 1e9), clock=clock
    )

    def leap_to(seconds, tick_count):
        clock.set_ros_time_override(Time(nanoseconds=int(seconds * 1e9)))
        wait_for(lambda: len(ticks) == tick_count, f'the tick at {seconds}')
        return missed()

    missed = count_missed(executor, node, timer)
    with spinning(executor):
        wait_for(lambda: timer in executor_entities(executor, node), 'the timer to be seen')
        assert leap_to(101.05, 1) == MissedCounts()
        assert leap_to(102.2, 2) == MissedCounts(late_ticks=1)
        assert leap_to(107.5, 3) == MissedCounts(late_ticks=2, skipped_ticks=4)
        assert leap_to(108.0, 4) == MissedCounts(late_ticks=2, skipped_ticks=4)
        timer.reset()
        assert leap_to(109.0, 5) == MissedCounts(late_ticks=2, skipped_ticks=4)


def executor_entities(executor, node):
    source = executor._spinner.registry
    return source._nodes[node].sources if node in source._nodes else {}


def test_ticks_behind_a_slow_callback_of_their_group_are_late_and_skipped(
    node, executor, wait_for
):
    slow = Slow(node)
    ticks = []
    timer = node.create_timer(0.05, lambda: ticks.append(1))
    missed = count_missed(executor, node, timer)
    publisher = advertise(node, 'RELIABLE', wait_for)
    with spinning(executor):
        publisher.publish(Int32())
        wait_for(lambda: slow.heard, 'the message')
        before = missed()
        count = len(ticks)
        ended = threading.Timer(1.0, slow.may_end.set)
        ended.start()
        wait_for(lambda: len(ticks) > count, 'the next tick')
        after = missed()
        assert after.late_ticks > before.late_ticks
        assert after.skipped_ticks - before.skipped_ticks >= 18
