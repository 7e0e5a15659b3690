"""A system of many nodes, some of which do their worst: the others miss not one message."""

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Int32

pytestmark = pytest.mark.ros

CODE = """
import ctypes
import multiprocessing
import os
import sys
import threading
import time
from pathlib import Path

leaked = []

def count(node):
    node.state.sent += 1
    return node.state.sent

def hear(node, message):
    node.state.heard += 1
    if message.data != node.state.heard:
        node.logger.fatal(f'missed: {message.data} came as number {node.state.heard}')
    if node.state.heard == 60:
        node.logger.info('heard all')

def wait_for_peer(node):
    while not all(p.get_subscription_count() for p in node.ros.publishers
                  if p.topic_name.startswith('/count')):
        time.sleep(0.01)

async def fail_async(node):
    raise GeneratorExit

def hang(node):
    threading.Event().wait(30)

def hang_in_c(node):
    time.sleep(30)

def leak(node):
    leaked.append(bytearray(100_000))
    leaked.append(open(os.devnull))
    threading.Thread(target=time.sleep, args=(30,), daemon=True).start()

def fork_and_raise(node):
    child = os.fork()
    if not child:
        raise SystemExit(3)
    os.waitpid(child, 0)

def leave(node):
    sys.exit(1)

def spin(node):
    end = time.monotonic() + 30
    while time.monotonic() < end and not Path('over').exists():
        pass

def destroy(node):
    node.ros.destroy_node()

def shut_down(node):
    node.ros.context.shutdown()

def stop_executor(node):
    node.ros.executor.shutdown()
"""

BAD = (
    'fail_async', 'hang', 'hang_in_c', 'leak', 'fork_and_raise',
    'leave', 'spin', 'destroy', 'shut_down', 'stop_executor',
)  # fmt: skip


def test_the_other_nodes_of_a_system_miss_not_one_message(compose):
    pairs = '\n'.join(
        f"""
  talker{n}:
    state: {{sent: 0}}
    publishers: {{count{n}: {{type: std_msgs/msg/Int32, qos: 1000}}}}
    timers: {{count: {{period: 0.02, behaviour: 'parts:count', publish: count{n}}}}}
    on_start: parts:wait_for_peer
  listener{n}:
    state: {{heard: 0}}
    subscriptions: {{count{n}: {{type: std_msgs/msg/Int32, qos: 1000, behaviour: 'parts:hear'}}}}
"""
        for n in range(2)
    )
    bad = '\n'.join(
        f"  bad_{name}: {{warn_after: 0.5, timers: {{t: {{period: 0.1, behaviour: 'parts:{name}'}}}}}}"
        for name in BAD
    )
    text = f'version: 1\nexecutor: {{shutdown_timeout: 1.0}}\nnodes:\n{pairs}\n{bad}\n'
    child = compose(text, CODE)
    child.wait_for_line('heard all', times=2)
    (compose.folder / 'over').touch()

    assert child.stop() == 1, 'two behaviours hang for good'
    assert not child.matching('missed')
    for name in ('hang', 'hang_in_c', 'spin'):
        assert child.matching(f"[WARN] [bad_{name}]: timer 't' ")
    for name in ('fail_async', 'leave', 'destroy', 'shut_down', 'stop_executor'):
        assert child.matching(f"[ERROR] [bad_{name}]: timer 't' ")
    for name in ('hang', 'hang_in_c'):
        assert child.matching(f"node 'bad_{name}': timer 't' did not end in time; it is at")


SABOTAGE = """
import ctypes
import sys
import threading
from pathlib import Path

def say(node):
    node.logger.info('stopping')

def close_output():
    sys.stdout.close()
    sys.stderr.close()

def throw_into_main():
    main = ctypes.c_ulong(threading.main_thread().ident)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(main, ctypes.py_object(ZeroDivisionError))

def harm(node, how):
    if not Path('harmed').exists():
        Path('harmed').touch()
        globals()[how]()
"""


@pytest.mark.parametrize(
    ('how', 'exit_code'),
    [
        ('close_output', 0),
        ('throw_into_main', 3),
    ],
)
def test_what_harms_the_whole_process_keeps_no_other_node_from_running_and_stopping(
    compose, peer, wait_for, how, exit_code
):
    compose.may_lose_threads = True
    text = f"""
        version: 1
        nodes:
          good:
            publishers: {{numbers: std_msgs/msg/Int32}}
            timers: {{tell: {{period: 0.02, publish: numbers, message: 1}}}}
            on_stop: parts:say
          bad:
            timers: {{harm: {{period: 0.2, behaviour: 'parts:harm', with: {{how: {how}}}}}}}
    """
    numbers = peer.listen(Int32, 'numbers')
    child = compose(text, SABOTAGE)
    wait_for((compose.folder / 'harmed').exists, 'the harm')
    if exit_code == 0:
        heard = len(numbers)
        wait_for(lambda: len(numbers) > heard + 5, 'what the other node says')
        assert child.stop() == 0
    else:
        assert child.wait() == exit_code
    assert child.matching('[good]: stopping')


def test_what_behaviours_leave_to_the_end_of_the_process_does_not_keep_it_alive(compose):
    text = """
        version: 1
        nodes: {bad: {on_start: 'parts:stay'}}
    """
    code = """
        import atexit
        import threading

        from composer.cli import main as cli

        def stay(node):
            cli._LONGEST_EXIT_SEC = 0.5
            atexit.register(threading.Event().wait)
    """
    child = compose(text, code)
    child.wait_until_ready()

    assert child.stop() == 1
    assert child.matching('Timeout (0:00:00.5')
