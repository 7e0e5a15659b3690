"""Traces: five questions to the file that a running system writes, and to that of a case."""

import json
from collections import defaultdict
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from composer.runtime.tracing import tracer as module
from composer.runtime.tracing.timeline import Timeline
from composer.runtime.tracing.tracer import TracePart, Tracer

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  lidar:
    publishers: {scan: {type: std_msgs/msg/Int64}}
    timers: {tick: {rate: 50, behaviour: parts:tick, publish: scan}}
  fusion:
    subscriptions:
      scan: {type: std_msgs/msg/Int64, behaviour: parts:fuse, publish: map}
      again: {topic: scan, type: std_msgs/msg/Int64, behaviour: parts:ignore}
    publishers: {map: {type: std_msgs/msg/Int64}}
  planner:
    subscriptions:
      map: {type: std_msgs/msg/Int64, qos: {depth: 2}, behaviour: parts:plan, publish: cmd}
    publishers: {cmd: {type: std_msgs/msg/Int64}}
    service_clients: {grid: {type: std_srvs/srv/Trigger}}
    timers: {ask: {rate: 5, behaviour: parts:ask, group: other}}
  grid:
    services: {grid: {type: std_srvs/srv/Trigger, behaviour: parts:answer}}
  motor:
    subscriptions: {cmd: {type: std_msgs/msg/Int64, behaviour: parts:drive}}
    timers: {hold: {rate: 100, behaviour: parts:hold}}
"""
CODE = """
import time

def tick(node):
    return 1

def fuse(node, message):
    return message.data

def ignore(node, message):
    pass

def plan(node, message):
    time.sleep(0.05)
    return message.data

async def ask(node):
    await node.call_async('grid')

def answer(node, request):
    time.sleep(0.01)
    return {'success': True}

def drive(node, message):
    print('driven')

def hold(node):
    time.sleep(0.025)
"""
SCENARIO = """
version: 1
system: {file: system.yaml}
until: 1
cases:
  drives: {then: [{topic: /cmd, count: [1, 100]}]}
"""
CASE = 'drives.scenario.yaml::drives'


class Trace:
    """A file of `Trace Event Format`, read as `chrome://tracing` does."""

    def __init__(self, path):
        self.events = json.loads(path.read_text())['traceEvents']
        self.slices = [event for event in self.events if event['ph'] == 'X']
        self.nodes = self._names('process_name', 'pid')
        self.tracks = self._names('thread_name', 'tid')

    def _names(self, name, key):
        return {
            event[key]: event['args']['name'] for event in self.events if event['name'] == name
        }

    def spans(self, category):
        found = defaultdict(list)
        for event in self.slices:
            if event['cat'] == category:
                found[self.nodes[event['pid']].replace(f' ({CASE})', ''), event['name']].append(
                    event['dur'] / 1000
                )
        return found

    def arrows(self):
        """Return from which slice to which callback arrows go, as the innermost slices say."""
        ends, open_slices = defaultdict(dict), defaultdict(list)
        order = {'X': 0, 's': 1, 'f': 1}
        events = [event for event in self.events if event['ph'] in order]
        for event in sorted(events, key=lambda event: event['ts']):
            stack = open_slices[event['tid']]
            while stack and stack[-1]['ts'] + stack[-1]['dur'] < event['ts']:
                stack.pop()
            if event['ph'] == 'X':
                stack.append(event)
            else:
                ends[event['id']][event['ph']] = stack[-1]
        return {
            tuple(f'{self.nodes[pair[ph]["pid"]]} {pair[ph]["name"]}' for ph in 'sf')
            for pair in ends.values()
        }

    def marks(self):
        return {
            (self.nodes[event['pid']].replace(f' ({CASE})', ''), event['name'])
            for event in self.events
            if event['ph'] == 'i'
        }

    def check_nesting(self):
        """No two slices of a track overlap, unless one is in the other."""
        ends = defaultdict(list)
        for event in sorted(self.slices, key=lambda event: (event['ts'], -event['dur'])):
            stack, begin = ends[event['tid']], event['ts']
            while stack and stack[-1] <= begin:
                stack.pop()
            assert not stack or begin + event['dur'] <= stack[-1] + 0.0015, event
            stack.append(begin + event['dur'])


ARROWS = {
    ('/lidar publish /scan', "/fusion subscription 'scan'"),
    ('/lidar publish /scan', "/fusion subscription 'again'"),
    ('/fusion publish /map', "/planner subscription 'map'"),
    ('/planner publish /cmd', "/motor subscription 'cmd'"),
}


def _check(trace, shortest_ms=49.9):
    trace.check_nesting()
    callbacks = trace.spans('callback')
    assert callbacks['/fusion', "subscription 'scan'"]
    assert min(callbacks['/planner', "subscription 'map'"]) >= shortest_ms
    calls = trace.spans('call')['/planner', "call service '/grid'"]
    assert len(calls) == pytest.approx(len(callbacks['/planner', "timer 'ask'"]), abs=1)
    lengths = [event['args']['messages'] for event in trace.events if event['ph'] == 'C']
    assert {0, 1, 2} <= set(lengths)
    queues = {
        (
            trace.nodes[event['pid']].replace(f' ({CASE})', '').replace(' (other)', ''),
            event['name'],
        )
        for event in trace.events
        if event['ph'] == 'C'
    }
    # Each of two queues for one topic has a counter.
    assert queues == {
        ('/fusion', "queue subscription 'scan'"),
        ('/fusion', "queue subscription 'again'"),
        ('/planner', "queue subscription 'map'"),
        ('/motor', "queue subscription 'cmd'"),
    }
    assert ('/planner', "dropped subscription 'map'") in trace.marks()


def test_a_running_system_is_traced_from_beside_it(compose, capsys):
    system = compose(SYSTEM, CODE)
    system.wait_until_ready()
    path, next_path = compose.folder / 'trace.json', compose.folder / 'next.json'
    assert run(['trace', '--seconds', '2', '-o', str(path)]) == 0
    trace = Trace(path)
    _check(trace)
    assert ('/motor', "late timer 'hold'") in trace.marks()
    assert trace.arrows() == ARROWS
    out = capsys.readouterr().out
    chain = out.partition('longest chain:')[2].splitlines()[1:5]
    assert [line.split('ms  ')[1] for line in chain] == [
        "/lidar timer 'tick'",
        "/fusion subscription 'scan'",
        "/planner subscription 'map'",
        "/motor subscription 'cmd'",
    ]
    assert "/planner for service '/grid'" in out
    # The next one begins anew.
    assert run(['trace', '--seconds', '0.3', '-o', str(next_path)]) == 0
    assert len(Trace(next_path).slices) < len(trace.slices) / 2


def test_a_whole_run_is_traced_with_its_workers(compose, capsys):
    text = SYSTEM.replace('  motor:\n', '  motor:\n    worker: other\n')
    system = compose(f'{text}workers: {{other: {{}}}}\n', CODE, '--trace', 'trace.json')
    system.wait_until_ready()
    other = compose.folder / 'other.json'
    assert run(['trace', '-o', str(other)]) == 1
    assert capsys.readouterr().err == 'error: the system is traced already, by up --trace\n'
    system.wait_for_line('driven', times=10)
    assert system.stop() == 0
    trace = Trace(compose.folder / 'trace.json')
    _check(trace)
    assert ('/motor (other)', "late timer 'hold'") in trace.marks()
    # What goes over the middleware has no arrow.
    assert trace.arrows() == {arrow for arrow in ARROWS if '/motor' not in arrow[1]}
    assert 'longest callbacks:' in system.output


def test_a_case_has_a_timeline_in_virtual_time(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('system.yaml').write_text(SYSTEM)
    Path('parts.py').write_text(CODE)
    Path('drives.scenario.yaml').write_text(SCENARIO)
    for name in ('one.json', 'two.json'):
        assert run(['test', '-q', '--timeline', name, 'drives.scenario.yaml']) == 0
    trace = Trace(tmp_path / 'one.json')
    _check(trace)
    assert trace.arrows() == {
        tuple(f'{end.replace(" ", f" ({CASE}) ", 1)}' for end in arrow) for arrow in ARROWS
    }
    assert Path('one.json').read_bytes() == Path('two.json').read_bytes()


def test_a_trace_is_bounded(monkeypatch):
    monkeypatch.setattr(module, 'MOST_EVENTS', 2)
    tracer = Tracer()
    tracer.turn_on()
    for _ in range(3):
        tracer.end('callback', '/n', 'timer', tracer.begin())
    part = TracePart(*json.loads(json.dumps(tracer.take(()))))
    assert (len(part.events), part.lost) == (2, 1)
    assert (
        Timeline({'': part})
        .summarize()
        .endswith('1 more events were left out: trace for a shorter time')
    )
