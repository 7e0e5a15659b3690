"""Parts of a system on several hosts notice that their clocks differ."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from composer.runtime.control.protocol import node_name
from composer.runtime.health import other_clocks
from composer.runtime.health.diagnostic_status import system_status
from composer.runtime.health.system_state import SystemState

pytestmark = pytest.mark.ros


class _Part:
    """The control node of a part whose clock may be wrong."""

    def __init__(self, host, context):
        self.ahead_sec = 0.0
        self.state = SystemState(f'robot@{host}', 'robot.yaml')
        self.node = Node(node_name(f'robot@{host}'), context=context)
        spec = SimpleNamespace(name='robot', host=host, hosts={'front': None, 'rear': None})
        other_clocks.OtherClocks(self.node, spec, self.state, self._now_ns)

    def _now_ns(self):
        return time.time_ns() + int(self.ahead_sec * 1e9)


@pytest.fixture
def parts(domain_id, monkeypatch):
    """Return the parts of two hosts, and a function that spins until something is so."""
    monkeypatch.setattr(other_clocks, '_LOOK_SEC', 0.02)
    monkeypatch.setattr(other_clocks, '_COMPARE_SEC', 0.1)
    context = Context()
    rclpy.init(context=context, domain_id=domain_id)
    executor = SingleThreadedExecutor(context=context)
    parts = [_Part(host, context) for host in ('front', 'rear')]
    for each in parts:
        executor.add_node(each.node)

    def spin_until(condition):
        deadline = time.monotonic() + 30
        while not condition():
            assert time.monotonic() < deadline
            executor.spin_once(timeout_sec=0.1)

    yield *parts, spin_until
    executor.shutdown()
    for each in parts:
        each.node.destroy_node()
    context.shutdown()


@pytest.fixture
def told(monkeypatch):
    """Return what was logged: kinds and texts."""
    lines = []
    log = SimpleNamespace(
        warning=lambda text: lines.append(('warning', text)),
        info=lambda text: lines.append(('info', text)),
    )
    monkeypatch.setattr(other_clocks, 'system_logger', log)
    return lines


def test_a_clock_that_is_wrong_is_told_once_until_it_changes(parts, told):
    front, rear, spin_until = parts

    def compare_again():
        """Spin until both have compared the clocks as they are now."""
        for each in (front, rear):
            each.state.clocks.clear()
        for _ in range(2):
            spin_until(lambda: front.state.clocks and rear.state.clocks)
            front.state.clocks.clear()
        spin_until(lambda: front.state.clocks)

    compare_again()
    assert told == []
    rear.ahead_sec = 10.5
    spin_until(lambda: len(told) == 2)
    compare_again()
    # The exact figure depends on how busy the machine is.
    assert sorted((kind, text[: text.index('is') + 5]) for kind, text in told) == [
        ('warning', 'the clock of host front is 10'),
        ('warning', 'the clock of host rear is 10'),
    ]
    assert any('ms ahead of that of host front: let both' in text for _, text in told)
    assert any('ms behind that of host rear: let both' in text for _, text in told)
    status = system_status('/control', front.state)
    shown = {each.key: each.value for each in status.values}
    assert status.message == 'starting; the clock of rear differs'
    assert abs(float(shown['clock of rear (ms)']) - 10_500) < 1000
    rear.ahead_sec = 0.0
    spin_until(lambda: len(told) == 4)
    assert sorted(told[2:]) == [
        ('info', 'the clock of host front is right again'),
        ('info', 'the clock of host rear is right again'),
    ]
