"""What a test does with a simulated system."""

import sys
import threading
import time

import pytest

from composer.errors import ComposerError, GoalRejectedError, ParametersRefusedError, StartError
from composer.simulation.trace import render_event
from composer.virtual_time.stuck_threads import SimulationStuckError

pytestmark = pytest.mark.ros

TALKER = """
    nodes:
      talker:
        parameters: {text: hello}
        publishers: {/words: std_msgs/msg/String}
        timers: {tick: {period: 0.5, behaviour: "parts:tick", publish: /words}}
        services: {/ask: {type: std_srvs/srv/Trigger, behaviour: "parts:answer"}}
      listener:
        subscriptions: {/words: {type: std_msgs/msg/String, behaviour: "parts:hear"}}
"""
CODE = """
    import time

    count = 0

    def tick(node):
        global count
        count += 1
        return f'{node.parameters.text} {count}'

    def hear(node, message):
        node.state.last = message.data

    def answer(node, request):
        time.sleep(0.75)
        return {'success': True, 'message': 'well'}
"""


def test_time_passes_in_forward_only(simulate):
    with simulate(TALKER, CODE) as system:
        system.forward(2.0)
        assert system.now == 2.0
        time.sleep(0.05)
        assert system.now == 2.0
        assert [each.data for each in system.messages('/words')] == [
            'hello 1', 'hello 2', 'hello 3', 'hello 4',
        ]  # fmt: skip
        assert system.state('listener').last == 'hello 4'


def test_forward_until_a_condition_holds(simulate):
    with simulate(TALKER, CODE) as system:
        assert system.forward_until(lambda: len(system.messages('words')) == 3)
        assert system.now == 1.5
        assert not system.forward_until(lambda: False, timeout=1.0)
        assert system.now == 2.5
        # One that waits itself: the service takes 0.75 s each time.
        calls = iter(range(10))
        assert system.forward_until(lambda: system.call('ask') and next(calls) == 2)
        assert system.now == 2.5 + 3 * 0.75


def test_a_test_publishes_calls_and_sets(simulate):
    with simulate(TALKER, CODE) as system:
        system.publish('/words', 'mine')
        system.forward(0)
        assert system.state('/listener').last == 'mine'
        assert system.call('/ask').message == 'well'
        assert system.now == 0.75
        system.set_parameters('talker', {'text': 'bye'})
        assert system.parameters('talker')['text'] == 'bye'
        system.forward(0.5)
        assert system.messages('/words')[-1].data == 'bye 2'
        with pytest.raises(ParametersRefusedError, match='text'):
            system.set_parameters('talker', {'text': 5})
        with pytest.raises(ComposerError, match="there is no node 'talkr'"):
            system.state('talkr')
        with pytest.raises(ComposerError, match="nobody in the system has a topic '/wrds'"):
            system.publish('/wrds', 'x')


def test_functions_are_called_at_their_times(simulate):
    seen = []
    system = simulate(TALKER, CODE)

    def wait():
        time.sleep(0.5)
        seen.append((system.call('/ask').message, system.now))

    system.at(1.0, wait)
    system.at(0.25, lambda: seen.append(system.now))
    with system:
        system.forward(3.0)
    assert seen == [0.25, ('well', 2.25)]


def test_the_same_system_runs_again_and_again(simulate):
    """Nothing of a run is left in the next: no module's global, no thread, no chance."""
    threads, modules = threading.active_count(), set(sys.modules)
    traces = set()
    for _ in range(3):
        with simulate(TALKER, CODE) as system:
            system.call('/ask')
            system.forward(3.0)
        traces.add('\n'.join(map(render_event, system.events)))
        assert 'parts' not in set(sys.modules) - modules
    assert len(traces) == 1
    assert '"hello 1"' in next(iter(traces))
    assert threading.active_count() == threads


def test_a_shuffled_run_is_repeatable(simulate):
    def run():
        with simulate(TALKER, CODE, is_shuffled=True, seed=1) as system:
            system.call('/ask')
            system.forward(3.0)
        return '\n'.join(map(render_event, system.events))

    assert run() == run()


ACTION = """
    nodes:
      server:
        actions:
          /count: {type: test_msgs/action/Fibonacci, behaviour: "parts:count", accept: "parts:accept"}
"""
ACTION_CODE = """
    import time

    def accept(node, goal):
        return goal.order < 10 or 'too many'

    def count(node, goal):
        numbers = []
        for each in range(goal.order):
            time.sleep(0.5)
            numbers.append(each)
            yield numbers
        return numbers
"""


def test_goals_run_side_by_side(simulate):
    pytest.importorskip('test_msgs.action')
    with simulate(ACTION, ACTION_CODE) as system:
        long, short = system.send_goal('/count', {'order': 4}), system.send_goal('/count', 2)
        assert (long.status, long.result, short.status) == ('executing', None, 'executing')
        system.forward(1.25)
        assert len(long.feedback) == 2
        assert long.cancel()
        system.forward(1.0)
        assert long.status == 'canceled'
        system.forward(2.0)
        assert (short.status, list(short.result.sequence)) == ('succeeded', [0, 1])
        with pytest.raises(GoalRejectedError):
            system.send_goal('/count', {'order': 50})


CLIENT = """
    nodes:
      client:
        service_clients: {/light: std_srvs/srv/SetBool}
        timers: {tick: {period: 1.0, behaviour: "parts:tick"}}
"""
CLIENT_CODE = """
    def tick(node):
        node.state.answer = node.call('/light', True).message
"""


def test_a_stand_in_serves(simulate):
    system = simulate(CLIENT, CLIENT_CODE)

    def answer(request):
        time.sleep(0.25)
        return {'success': True, 'message': str(request.data)}

    system.serve('/light', answer)
    with system:
        system.forward(1.5)
        assert system.state('client').answer == 'True'


def test_the_system_ends_with_its_exit_code(simulate):
    code = 'def tick(node): node.shutdown(3)'
    nodes = 'nodes: {n: {timers: {t: {period: 1.0, behaviour: "parts:tick"}}}}'
    with simulate(nodes, code) as system:
        assert system.exit_code is None
        system.forward(10.0)
        assert (system.now, system.exit_code) == (1.0, 3)


@pytest.mark.parametrize(
    ('code', 'text'),
    [
        ('def begin(node): raise ValueError("no")', r"on_start raised ValueError\('no'\)"),
        ('import threading\ndef begin(node): threading.Event().wait()', 'has not started within'),
    ],
)
def test_a_system_that_cannot_start_leaves_nothing(simulate, code, text):
    threads = threading.active_count()
    with pytest.raises(StartError, match=text):
        simulate('nodes: {n: {on_start: "parts:begin"}}', code).start()
    assert threading.active_count() == threads
    with simulate(TALKER, CODE) as system:
        system.forward(1.0)


def test_a_loop_without_end_is_found_and_ended(simulate):
    threads = threading.active_count()
    nodes = 'nodes: {n: {timers: {t: {period: 1.0, behaviour: "parts:tick"}}}}'
    code = 'def tick(node):\n    while True: pass'
    with simulate(nodes, code, real_limit_sec=0.5) as system:
        with pytest.raises(SimulationStuckError):
            system.forward(2.0)
        assert sys._current_frames()  # the process goes on
    assert threading.active_count() == threads


@pytest.mark.parametrize(
    ('code', 'what'),
    [
        ('import subprocess\ndef f(node): subprocess.run(["true"])', 'starts a process'),
        ('import time\ndef f(node): time.process_time()', 'counts real work'),
        ('import numpy as np\ndef f(node): np.datetime64("now")', 'reads a clock in C'),
        ('import threading\ndef f(node): threading.Thread(target=print).start()', 'a thread'),
        (
            'from socket import socket\ndef f(node, s=socket()): s.bind(("", 0)) or s.close()',
            'uses a socket',
        ),
        ('import os\ndef f(node): os.getpid(), os.getpid()', 'the number of a process'),
        ('from os.path import *\ndef f(node): getmtime(__file__)', 'reads st_mtime of a file'),
        ('import tempfile\ndef f(node): tempfile.NamedTemporaryFile()', 'makes a temporary file'),
        ('import socket\ndef f(node): socket.gethostname()', 'the name of this machine'),
        ('\ndef f(node): id(node)', 'an address'),
    ],
)
def test_what_may_be_otherwise_is_noted(simulate, code, what):
    nodes = 'nodes: {n: {timers: {t: {period: 1.0, behaviour: "parts:f"}}}}'
    with simulate(nodes, code) as system:
        system.forward(1.0)
    (notice,) = system.notices
    assert what in str(notice)
    assert notice.file.endswith('parts.py')
    assert notice.line == 2


def test_what_is_not_done_or_tells_nothing_is_not_noted(simulate):
    nodes = 'nodes: {n: {timers: {t: {period: 1.0, behaviour: "parts:f"}}}}'
    code = """
        import copy, json, logging, os, pathlib, socket, tempfile, threading
        import numpy as np

        def never():
            np.datetime64('now')

        def f(node):
            logging.getLogger('parts').warning('a line has the number of its process')
            copy.deepcopy([node.name])
            here, there = socket.socketpair()
            here.close(), there.close()
            tempfile.TemporaryFile().close()
            pathlib.Path(__file__).exists(), os.path.getsize(__file__)
            threading.local().x = threading.current_thread().name
            import colorsys
        """
    with simulate(nodes, code) as system:
        system.forward(1.0)
        assert system.events[-1].kind != 'error'
    assert system.notices == []
