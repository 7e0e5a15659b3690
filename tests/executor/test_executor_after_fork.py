"""A child that a callback forks: the parent misses nothing, and the child ends."""

import json

import pytest

pytest.importorskip('rclpy')

from spinning import run_program

pytestmark = pytest.mark.ros

_PROGRAM = """
import json, os, sys, threading, time
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from functools import partial
from composer.errors import ComposerError
from composer.executor import ComposerExecutor

rclpy.init()
node = rclpy.create_node('node')
executor = ComposerExecutor()
executor.add_node(node)
got, sent, children, codes, answers = [], [], [], [], []


def group():
    return MutuallyExclusiveCallbackGroup()


def publish():
    publisher.publish(Int32(data=len(sent)))
    sent.append(1)


def fork():
    if len(children) < 5:
        child = os.fork()
        if child:
            children.append(child)
        else:
            in_child()


def in_child():
    CHILD


def serve(request, response):
    fork()
    return response


publisher = node.create_publisher(Int32, 'count', 1000)
node.create_subscription(Int32, 'count', lambda m: got.append(m.data), 1000, callback_group=group())
service = node.create_service(Trigger, 'serve', serve, callback_group=group())
client = node.create_client(Trigger, 'serve', callback_group=group())
node.create_timer(0.002, publish, callback_group=group())
node.create_timer(0.02, WHO, callback_group=group())
spinning = threading.Thread(target=executor.spin)
spinning.start()
deadline = time.monotonic() + 60
while len(codes) < 5 and time.monotonic() < deadline:
    time.sleep(0.01)
    for child in children[len(codes):]:
        ended, status = os.waitpid(child, os.WNOHANG)
        if not ended:
            break
        codes.append(os.waitstatus_to_exitcode(status))
seen = len(sent)
while len(got) < seen + 10 and time.monotonic() < deadline:
    time.sleep(0.01)
executor.shutdown()
spinning.join()
print(json.dumps([codes, got == list(range(len(got))), len(got) >= seen + 10, len(answers)]))
for child in children[len(codes):]:
    os.kill(child, 9)
"""
_CALL = """lambda: client.call_async(Trigger.Request()).add_done_callback(answers.append)"""


def _run(domain_id, who, in_child):
    program = _PROGRAM.replace('WHO', who).replace('CHILD', in_child)
    lines, stderr = run_program(program, domain_id)
    return [*json.loads(lines[-1]), stderr]


# Each child ends in another way.
_ENDS = """
    ends = ('pass', 'sys.exit(3)', 'sys.exit("by exit")', 'raise ValueError("raised")', 'os._exit(7)')
    exec(ends[len(children)])
"""


def test_a_child_ends_with_its_callback_and_the_parent_misses_nothing(domain_id):
    codes, in_order, arrived, _, stderr = _run(domain_id, 'fork', _ENDS)
    assert codes == [0, 3, 1, 1, 7]
    assert in_order
    assert arrived
    assert stderr.count('by exit') == 1
    assert stderr.count('ValueError: raised') == 1


_USE = """
    executor.create_task(print)
    executor.wake()
    executor.remove_node(node)
    for refused in (executor.spin, executor.spin_once, partial(executor.add_node, node)):
        try:
            refused()
        except ComposerError as error:
            assert 'forked child' in str(error)
        else:
            sys.exit(5)
    sys.exit(4 if executor.shutdown() else 6)
"""


def test_a_child_is_refused_the_executor(domain_id):
    others = 'descriptors = [os.open(os.devnull, 0) for _ in range(99)]'
    codes, in_order, arrived, _, stderr = _run(domain_id, 'fork', others + _USE)
    assert codes == [4] * 5
    assert in_order
    assert arrived
    assert not stderr


def test_a_child_of_a_service_leaves_the_answer_to_its_parent(domain_id):
    codes, in_order, _, answers, stderr = _run(
        domain_id, _CALL, 'service.send_response = lambda *_: os._exit(9)'
    )
    assert codes == [0] * 5
    assert in_order
    assert answers >= 5
    assert not stderr
