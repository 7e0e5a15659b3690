"""What Composer adds to a message, beside the same lines written by hand on the same executor.

python -m benchmarks.overhead
"""

import json
import os
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node as RosNode
from std_msgs.msg import Int32, String

from composer.checks.checker import create_context
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.planning.snapshot_taking import take_snapshot
from composer.processes.guardian_client import GuardianClient
from composer.runtime.behaviours.calls import BehaviourCall
from composer.runtime.behaviours.running_calls import RunningCalls
from composer.runtime.health.statistics import CallTimes
from composer.runtime.rewiring.reading import Reading
from composer.runtime.system import System

_MESSAGES = 2000
_CALLS = 50_000
_CALL_ROUNDS = 41
_TIMEOUT_SEC = 60.0
_STOP_SEC = 5.0

# By message type, what the behaviour does: two make a new message, one passes it on.
ANSWERS: dict[str, tuple[type, Callable[[Any], Any]]] = {
    'std_msgs/msg/Int32': (Int32, lambda message: Int32(data=message.data + 1)),
    'std_msgs/msg/String': (String, lambda message: String(data=message.data)),
    'geometry_msgs/msg/Twist': (Twist, lambda message: message),
}

_SYSTEM = """
version: 1
nodes:
  relay:
    publishers:
      out: {{type: {type}, topic: composed_out}}
    subscriptions:
      in: {{type: {type}, topic: composed_in, behaviour: parts:answer, publish: out}}
"""


class _Driver:
    """Sends a message and waits for the answer to it, over and over."""

    def __init__(self, node: RosNode, message_class: type) -> None:
        self._message = message_class()
        self._left = 0
        self._done = threading.Event()
        self._publishers = {}
        for side in ('composed', 'plain'):
            publisher = node.create_publisher(message_class, f'{side}_in', 10)
            node.create_subscription(
                message_class,
                f'{side}_out',
                lambda _, send=publisher.publish: self._send_next(send),
                10,
            )
            self._publishers[side] = publisher

    def wait_for_peers(self) -> None:
        """Wait until both sides can be reached."""
        end = time.monotonic() + _TIMEOUT_SEC
        while not all(one.get_subscription_count() for one in self._publishers.values()):
            if time.monotonic() > end:
                message = 'the two sides did not meet'
                raise TimeoutError(message)
            time.sleep(0.01)

    def run(self, side: str) -> tuple[float, float]:
        """Return the µs of wall time and of processor time that a message and its answer take."""
        self._left = _MESSAGES
        self._done.clear()
        begin, used = time.perf_counter(), time.process_time()
        self._publishers[side].publish(self._message)
        if not self._done.wait(_TIMEOUT_SEC):
            message = f'{self._left} messages of the {side} side did not come back'
            raise TimeoutError(message)
        elapsed, spent = time.perf_counter() - begin, time.process_time() - used
        return elapsed / _MESSAGES * 1e6, spent / _MESSAGES * 1e6

    def _send_next(self, send: Callable[[Any], None]) -> None:
        self._left -= 1
        if self._left > 0:
            send(self._message)
        else:
            self._done.set()


def message_overhead(type_name: str, rounds: int) -> dict[str, float]:
    """Measure what Composer adds to: subscription, behaviour, publish.

    Returns:
        Medians over rounds of both sides in turn, in µs: what a message and its answer take on
        each side, and what Composer adds; of wall time, and of processor time (`_cpu`).
    """
    message_class, answer = ANSWERS[type_name]
    system = _start_composed(type_name, answer)
    context, executor = system._handle.context, system._executor  # noqa: SLF001
    plain = _create_plain(context, message_class, answer)
    driving = rclpy.create_node('driver', context=context)
    driver = _Driver(driving, message_class)
    for node in (plain, driving):
        executor.add_node(node)
    driver.wait_for_peers()
    # The first round warms up.
    taken = [(driver.run('composed'), driver.run('plain')) for _ in range(1 + rounds)][1:]
    for node in (plain, driving):
        executor.remove_node(node)
        node.destroy_node()
    system.stop()
    return {
        **_medians('', [(ours[0], theirs[0]) for ours, theirs in taken]),
        **_medians('_cpu', [(ours[1], theirs[1]) for ours, theirs in taken]),
    }


def measuring_overhead() -> dict[str, float]:
    """Measure what measuring adds to a call of a behaviour, in ns.

    Returns:
        Medians of the processor time of a call, over rounds of both kinds in turn.
    """

    def create(times: CallTimes | None) -> Callable[[], float]:
        call = BehaviourCall(
            'it',
            lambda message: message,
            RunningCalls(),
            deliver=lambda _: None,
            failed=lambda _owner, _error: None,
            add_time=None if times is None else times.add,
        ).run

        def run() -> float:
            begin = time.thread_time_ns()
            for _ in range(_CALLS):
                call(None)
            return (time.thread_time_ns() - begin) / _CALLS

        return run

    measured, bare = create(CallTimes()), create(None)
    rounds = [(measured(), bare()) for _ in range(_CALL_ROUNDS)]
    return {
        'measured_ns': statistics.median(one[0] for one in rounds),
        'bare_ns': statistics.median(one[1] for one in rounds),
        'added_ns': statistics.median(one[0] - one[1] for one in rounds),
    }


def _start_composed(type_name: str, answer: Callable[[Any], Any]) -> System:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'overhead.yaml'
        path.write_text(_SYSTEM.format(type=type_name))
        loaded = load_system(path)
    context = create_context(loaded, InterfaceCatalogue())
    if context is None:
        message = f'the system cannot be read: {loaded.diagnostics}'
        raise ValueError(message)
    functions = {'parts:answer': lambda _node, message: answer(message)}
    guardian = GuardianClient(_STOP_SEC, _STOP_SEC, owns_process=True)
    reading = Reading(context.spec, loaded.positions, functions, take_snapshot(context))
    system = System(reading, guardian)
    system.start()
    return system


def _create_plain(context: Any, message_class: type, answer: Callable[[Any], Any]) -> RosNode:
    node = rclpy.create_node('plain', context=context)
    publisher = node.create_publisher(message_class, 'plain_out', 10)

    def reply(message: Any) -> None:
        publisher.publish(answer(message))

    node.create_subscription(message_class, 'plain_in', reply, 10)
    return node


def _medians(suffix: str, rounds: Sequence[tuple[float, float]]) -> dict[str, float]:
    return {
        f'composed{suffix}_us': statistics.median(ours for ours, _ in rounds),
        f'plain{suffix}_us': statistics.median(theirs for _, theirs in rounds),
        f'added{suffix}_us': statistics.median(ours - theirs for ours, theirs in rounds),
    }


if __name__ == '__main__':
    results = {'messages': {name: message_overhead(name, 15) for name in ANSWERS}}
    print(json.dumps({**results, 'measuring': measuring_overhead()}, indent=2), flush=True)
    os._exit(0)
