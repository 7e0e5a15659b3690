"""Somebody closes or replaces descriptors of the executor: it says so, and ends."""

import pytest

pytest.importorskip('rclpy')

from spinning import run_program

pytestmark = pytest.mark.ros

_PROGRAM = """
import os, sys, threading
import rclpy
from std_msgs.msg import Int32
from composer.executor import ComposerExecutor, LostDescriptorError

rclpy.init()
node = rclpy.create_node('node')
executor = ComposerExecutor()
executor.add_node(node)
publisher = node.create_publisher(Int32, 'count', 10)
node.create_subscription(Int32, 'count', lambda _: None, 10)
poller = executor._spinner.poller
ticks = []


def hurt():
    ticks.append(1)
    publisher.publish(Int32())
    if len(ticks) == 5:
        fd = WHAT
        HOW


node.create_timer(0.01, hurt)
for _ in range(2):
    try:
        executor.spin()
    except LostDescriptorError as error:
        print(error)
print(executor.shutdown(5.0), len(ticks) < 500)
sys.stdout.flush()
os._exit(0)
"""
_WHAT = {
    'epoll': 'poller._epoll.fileno()',
    'wake_up': 'poller._wake_fd',
    'subscription': 'max(poller.event_fds.by_number)',
    'standby': 'executor._spinner.workers._timer.fd',
}
_HOW = {
    'closed': 'os.close(fd)',
    'replaced': 'os.dup2(1, fd)',
    'replaced_by_its_kind': 'other = os.eventfd(0); os.dup2(other, fd)',
}


@pytest.mark.parametrize(
    ('what', 'how'),
    [
        ('epoll', 'closed'),
        ('wake_up', 'replaced_by_its_kind'),
        ('subscription', 'replaced'),
        ('standby', 'closed'),
    ],
)
def test_a_lost_descriptor_is_an_error_that_ends_the_spin(domain_id, what, how):
    program = _PROGRAM.replace('WHAT', _WHAT[what]).replace('HOW', _HOW[how])
    (*errors, last), stderr = run_program(program, domain_id)
    assert stderr == ''
    assert len(errors) == 2
    for error in errors:
        assert error.endswith('of the executor, was closed or replaced')
    assert last == 'True True'
