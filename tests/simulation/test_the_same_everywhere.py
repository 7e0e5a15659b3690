"""The same file and seed give the same events: in another process, folder and order of addresses,
beside other work, with another profile of the middleware, and when the log is shown."""

import shutil
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('test_msgs')
pytestmark = pytest.mark.ros

BEHAVIOURS = """
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

class Device:
    def __init__(self):
        self.itself = self

    def __del__(self):
        time.sleep(0.05)

def work(number):
    time.sleep(0.01 * (number % 3))
    return f'{number} {threading.current_thread().name}'

def pool(node):
    with ThreadPoolExecutor(3) as executor:
        futures = [executor.submit(work, number) for number in range(5)]
        return ', '.join(future.result() for future in as_completed(futures))

def waste(node):
    node.state.count += 1
    if node.state.count % 20 == 0:
        Device()
    return str(node.state.count)

def keep(node):
    node.publish('map', 'here')

def fail(node):
    node.state.count += 1
    if node.state.count == 4:
        node.logger.error('no port')
        raise OSError('no port')

def hear(node, message):
    node.logger.info(f'heard {getattr(message, "data", "")}')

def hear_log(node, log):
    if log.name != 'hearer':
        node.publish('lines', f'{log.stamp.sec} {log.name} {log.msg.splitlines()[0]}')

def run(node, goal):
    for step in range(goal.order):
        yield [step]
        time.sleep(0.01)
    return [goal.order]
"""
SYSTEM = """
version: 1
nodes:
  pools:
    publishers: {pooled: std_msgs/msg/String}
    timers: {pool: {period: 0.1, behaviour: 'hard:pool', publish: pooled}}
  waster:
    state: {count: 0}
    publishers: {old: {type: std_msgs/msg/String, qos: {depth: 50, lifespan: 0.004}}}
    timers: {waste: {period: 0.005, behaviour: 'hard:waste', publish: old}}
  keeper:
    publishers: {map: {type: std_msgs/msg/String, qos: {depth: 1, durability: transient_local}}}
    on_start: hard:keep
  late:
    state: {count: 0}
    on_error: restart
    subscriptions:
      map: {type: std_msgs/msg/String, behaviour: 'hard:hear', qos: {depth: 1, durability: transient_local}}
      old: {type: std_msgs/msg/String, behaviour: 'hard:hear', qos: {depth: 50, lifespan: 0.004}}
    timers: {fail: {period: 0.15, behaviour: 'hard:fail'}}
  hearer:
    publishers: {lines: std_msgs/msg/String}
    subscriptions: {rosout: {type: rcl_interfaces/msg/Log, topic: /rosout, behaviour: 'hard:hear_log', external: true}}
  server:
    actions: {run: {type: test_msgs/action/Fibonacci, behaviour: 'hard:run'}}
"""
SCENARIO = """
version: 1
system: {file: hard.yaml}
cases:
  all of it:
    when:
      - {at: 0.3, send_goal: /run, goal: {order: 5}, result: {sequence: [5]}}
      - {at: 0.5, send_goal: /run, goal: {order: 3}, result: {sequence: [3]}}
    then:
      - {log: late, text: heard here, count: 2, within: [0, 0.9]}
      - {error: late, text: no port}
      - {topic: /lines, count: [1, 100000]}
    until: 1.0
"""
PROFILE = """<?xml version="1.0" encoding="UTF-8" ?>
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <library_settings><intraprocess_delivery>OFF</intraprocess_delivery></library_settings>
</dds>
"""


def traced(folder, words, *options):
    command = [sys.executable, '-m', 'composer', 'test', *words, '--trace', 'trace', *options]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    return (folder / 'trace').read_text().splitlines()


def check_that_they_are_the_same(here, there, words, *options):
    there.mkdir()
    shutil.copytree(here, there / 'copy')
    (there / 'copy' / 'DEFAULT_FASTDDS_PROFILES.xml').write_text(PROFILE)
    busy = subprocess.Popen([sys.executable, '-c', 'while True: pass'])
    try:
        first = traced(here, words, *options)
        second = traced(there / 'copy', words, *options, '-s')
    finally:
        busy.kill()
        busy.wait()
    # The first line that differs says more than a thousand of them.
    pairs = zip(first, second, strict=False)
    assert next((pair for pair in pairs if pair[0] != pair[1]), None) is None
    assert len(first) == len(second)
    return first


@pytest.mark.long
def test_idioms_that_depend_on_addresses_and_real_time_are_the_same(tmp_path):
    here = tmp_path / 'here'
    here.mkdir()
    (here / 'hard.py').write_text(BEHAVIOURS)
    (here / 'hard.yaml').write_text(SYSTEM)
    (here / 'hard.scenario.yaml').write_text(SCENARIO)
    trace = check_that_they_are_the_same(
        here, tmp_path / 'there', ['hard.scenario.yaml'], '--shuffle', '2'
    )
    assert sum('# ' in line for line in trace if line.startswith('#')) == 3
