"""Timers go on when the wall clock is set, and a missing `/clock` is told."""

import shutil
import struct
import subprocess
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from rosgraph_msgs.msg import Clock

from composer.cli.main import run
from composer.runtime.health import watched_clocks
from composer.runtime.health.missed import MissedCounts, MissedTicks

pytestmark = pytest.mark.ros

HOUR_NS = 3_600_000_000_000
SOURCE = Path(__file__).with_name('wall_clock.c')
SYSTEM = """\
version: 1
nodes:
  heart:
    timers:
      ros: {period: 0.2, behaviour: 'parts:beat', with: {name: ros}}
      system: {period: 0.2, clock: system, behaviour: 'parts:beat', with: {name: system}}
      steady: {period: 0.2, clock: steady, behaviour: 'parts:beat', with: {name: steady}}
      rare: {period: 5000, behaviour: 'parts:beat', with: {name: rare}}
    on_start: parts:begin
  far:
    worker: w
    timers: {far: {period: 0.2, behaviour: 'parts:beat', with: {name: far}}}
"""
CODE = """\
def begin(node):
    node.create_timer(0.2, made)
    node.ros.create_timer(0.2, lambda: print('beat of plain'))
    node.ros.create_timer(0.2, lambda: print('beat of stopped')).cancel()


def made(node):
    print('beat of made')


def beat(node, name):
    print(f'beat of {name}')
"""
BEATING = 'ros', 'system', 'steady', 'far', 'made', 'plain'


@pytest.mark.skipif(shutil.which('gcc') is None, reason='gcc is not installed')
def test_timers_go_on_when_the_wall_clock_is_set(compose, tmp_path, monkeypatch):
    library, step = tmp_path / 'wall_clock.so', tmp_path / 'step'
    subprocess.run(['gcc', '-shared', '-fPIC', '-o', library, SOURCE, '-ldl'], check=True)
    step.write_bytes(struct.pack('q', 0))
    monkeypatch.setenv('LD_PRELOAD', str(library))
    monkeypatch.setenv('WALL_STEP', str(step))
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    monkeypatch.delenv('LD_PRELOAD')
    for name in BEATING:
        child.wait_for_line(f'beat of {name}')
    for way, step_ns in (('back', -HOUR_NS), ('forward', HOUR_NS)):
        with step.open('r+b') as file:
            file.write(struct.pack('q', min(step_ns, 0)))
        child.wait_for_line(f'the wall clock was set {way} by 3600.0 s')
        for name in BEATING:
            child.wait_for_line(f'beat of {name}', times=len(child.matching(name)) + 2)
    assert len(child.matching('the wall clock')) == 2
    assert not child.matching('beat of stopped')
    assert not child.matching('beat of rare')
    assert child.stop() == 0


def test_a_step_is_no_missed_tick(monkeypatch):
    ticks, now_ns = MissedTicks(), watched_clocks.time_ns
    for step_ns in (0, HOUR_NS):
        monkeypatch.setattr(watched_clocks, 'time_ns', lambda step_ns=step_ns: now_ns() + step_ns)
        ticks.on_tick(HOUR_NS, HOUR_NS, HOUR_NS // 3600)
        # Once the clock has moved on, what is late counts again.
        assert ticks() == MissedCounts(late_ticks=1, skipped_ticks=3599)


def test_nodes_that_wait_for_a_missing_clock_are_told_of_once(compose, peer, wait_for, capsys):
    system = """\
version: 1
defaults: {use_sim_time: true}
nodes:
  one: {timers: {t: {period: 0.1, behaviour: 'parts:beat', with: {name: one}}}}
  two: {timers: {t: {period: 0.1, behaviour: 'parts:beat', with: {name: two}}}}
"""
    child = compose(system, CODE)
    child.wait_for_line(
        "nobody publishes '/clock': with 'use_sim_time', the clock and the timers of node '/one' "
        'and 1 more stand still'
    )

    def health():
        assert run(['ps']) == 0
        return capsys.readouterr().out

    assert "health: nobody publishes '/clock'" in health()
    publisher = peer.run(peer.node.create_publisher, Clock, '/clock', 1)

    def is_beating():
        seconds = peer.node.get_clock().now().nanoseconds * 1e-9
        message = Clock()
        message.clock.sec, message.clock.nanosec = int(seconds), int(seconds % 1 * 1e9)
        publisher.publish(message)
        return bool(child.matching('beat of two'))

    wait_for(is_beating, 'ticks of simulated time')
    wait_for(lambda: 'nobody publishes' not in health(), 'good health')
    assert len(child.matching('nobody publishes')) == 1
    assert child.stop() == 0
