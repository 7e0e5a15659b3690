"""The commands that ask running systems, and what these answer."""

import json
import os
import re
import signal
import socket

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from tests.running import wait_for

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
executor: {threads: 1, shutdown_timeout: 0.5}
nodes:
  arm:
    namespace: robot
    state: {count: 0}
    timers:
      tick: {period: 0.05, behaviour: parts:tick, warn_after: 0.2}
  stuck:
    subscriptions:
      trigger: {type: std_msgs/msg/Empty, external: true, behaviour: parts:stick}
"""
CODE = """
import time

def tick(node):
    node.state.count += 1
    if node.state.count % 20 == 1:
        node.logger.info(f'count {node.state.count}')

def stick(node, message):
    time.sleep(3600)
"""


@pytest.fixture
def composer(capsys, monkeypatch, domain_id):
    """Run a command in the test's domain; return its exit code, output and errors."""

    def call(*words):
        code = run(list(words))
        return (code, *capsys.readouterr())

    return call


def test_what_runs_takes_commands_while_others_wait(compose, composer, wait_for):
    text = (
        SYSTEM.replace('stuck:\n', 'stuck:\n    delay: 3600\n')
        + 'processes: {late: {command: [sleep, "3600"], delay: 3600}}\n'
    )
    child = compose(text, CODE)
    child.wait_for_line('count 1')
    assert composer('restart', 'arm') == (0, "system: node '/robot/arm' was restarted\n", '')
    assert "system: node '/stuck' has not started yet" in composer('restart', 'stuck')[2]

    # What is gone is waited for no more.
    edited = text.replace('0.05', '0.04').replace('late:', 'later:').replace('3600}}', '0.1}}')
    (compose.folder / 'system.yaml').write_text(
        edited.replace('stuck:', 'quick:').replace(
            'quick:\n    delay: 3600', 'quick:\n    delay: 0.1'
        )
    )
    code, output, errors = composer('reload')
    assert (code, errors) == (0, '')
    assert 'reloaded in ' in output
    child.wait_until_ready()
    assert child.stop() == 0


def test_a_running_system_answers(compose, composer, monkeypatch):
    """Ask it all, in the order in which a user might."""
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    path = compose.folder / 'system.yaml'

    code, output, _ = composer('ps')
    assert code == 0
    # The machine may be busy, and ticks be late: that is noted below the table.
    header, row, *_ = output.splitlines()
    assert header.split()[:4] == ['NAME', 'STATE', 'HEALTH', 'NODES']
    assert row.startswith('system  running  ')
    assert row.split()[-3:] == [socket.gethostname(), str(child.pid), str(path)]

    message = (
        f"error: system 'system' (pid {child.pid}) does not write to a file\n"
        "  help: 'composer up --detach' writes to a file\n"
    )
    assert composer('logs', 'system') == (1, '', message)

    os.kill(child.pid, signal.SIGSTOP)
    try:
        code, _, errors = composer('reload', 'system')
        listed = composer('ps')[1]
    finally:
        os.kill(child.pid, signal.SIGCONT)
    message = f"error: system 'system' (pid {child.pid}) does not answer\n"
    assert (code, errors) == (1, message)
    told = ['?', 'no', 'answer', socket.gethostname(), str(child.pid)]
    assert listed.splitlines()[1].split() == told

    # As on a host that cannot look up the others now.
    monkeypatch.setenv('ROS_STATIC_PEERS', 'no-such-host.invalid;127.0.0.1')
    code, output, _ = composer('ps', '--format', 'json')
    monkeypatch.delenv('ROS_STATIC_PEERS')
    (told,) = json.loads(output)['systems']
    assert told['nodes'] == ['/robot/arm', '/stuck']
    assert told['last_reload'] is None

    assert composer('reload') == (0, 'system: nothing has changed\n', '')
    path.write_text(SYSTEM.replace('0.05', '0.04'))
    code, output, _ = composer('reload', 'system')
    assert (code, re.sub(r'\d+ ms', '_', output)) == (0, 'system: reloaded in _: ~1 timer\n')
    path.write_text(SYSTEM.replace('0.05', 'often'))
    code, output, errors = composer('reload')
    assert (code, output) == (1, '')
    assert 'error[' in errors
    assert errors.endswith('system: not reloaded: the system runs on as it was\n')
    assert 'system: last reload: ' in composer('ps')[1]
    path.write_text(SYSTEM)

    child.wait_for_line('count 21')
    started = len(child.matching('count 1'))
    assert composer('restart', 'arm') == (0, "system: node '/robot/arm' was restarted\n", '')
    child.wait_for_line('count 1', times=started + 1)

    assert composer('down', 'system') == (0, 'system: stopped\n', '')
    assert child.wait() == 0


ABSENT = 'on this ROS graph (ROS_DOMAIN_ID {domain})'
WRONG = {
    'no system': (('reload',), 1, f'error: no system runs {ABSENT}\n'),
    'no such system': (('down', 'robot'), 1, f"error: there is no system 'robot' {ABSENT}\n"),
    'no node': (
        ('restart', 'arm'),
        1,
        "error: no system on this ROS graph has a node or process 'arm'\n",
    ),
    'no time': (('reload', '--timeout', '0'), 2, 'error: '),
}


@pytest.mark.parametrize('name', WRONG)
def test_what_cannot_be_asked_is_told(composer, domain_id, name):
    words, code, message = WRONG[name]
    found, output, errors = composer(*words)
    assert (found, output) == (code, '')
    assert errors.startswith(message.format(domain=domain_id))


def test_external_processes_are_listed_and_restarted(compose, composer, wait_for):
    """One that has failed for good is no healthy system, until it is restarted."""
    busy = 'trap exit INT TERM; while :; do n=0; while [ $n -lt 2999 ]; do n=$((n+1)); done; sleep 0.1; done & wait'
    failing = 'while [ ! -e mended ]; do exit 3; done; sleep 3600'
    text = SYSTEM.replace('0.5', '20') + (
        'processes:\n'
        f'  busy: {{command: [sh, -c, "{busy}"]}}\n'
        f'  driver: {{command: [sh, -c, "{failing}"], restart: {{when: on_failure, max: 1}}}}\n'
        '  listed: {command: ["true"]}\n'
    )
    child = compose(text, CODE)
    child.wait_until_ready()

    def ask():
        (system,) = json.loads(composer('ps', '--format', 'json')[1])['systems']
        return system['health'], {each['name']: each for each in system['external_processes']}

    child.wait_for_line("process 'driver' has ended with exit code 3, and was started again")
    wait_for(lambda: ask()[1]['busy']['cpu'], 'what is used')
    health, processes = ask()
    assert processes['driver']['state'] == 'failed'
    message = "process 'driver': it has ended with exit code 3"
    assert health == {'level': 'error', 'message': message}
    assert [processes['driver'][key] for key in ('pid', 'restarts')] == [None, 1]
    assert processes['listed']['state'] == 'succeeded'
    assert processes['busy']['memory_bytes'] > 0
    for listed in (composer('ps')[1], composer('top', '--once')[1]):
        assert re.search(r'^system +driver +failed +- +1 +- +-$', listed, re.MULTILINE)
        row = rf'^system +busy +running +{processes["busy"]["pid"]} +0 +[0-9.]+% +[0-9.]+$'
        assert re.search(row, listed, re.MULTILINE)

    (compose.folder / 'mended').touch()
    assert composer('restart', 'driver')[0] == 0
    assert composer('restart', 'busy')[1] == "system: process 'busy' was restarted\n"
    health, after = ask()
    assert (after['driver']['state'], after['driver']['restarts']) == ('running', 0)
    assert after['busy']['pid'] != processes['busy']['pid']
    assert health['level'] != 'error'
    assert 'arm, busy, driver, listed, stuck' in composer('restart', 'absent')[2]
    assert child.stop() == 0, child.output


def test_several_systems_are_told_apart(compose, composer):
    for name in ('first', 'second', 'third'):
        text = SYSTEM.replace('arm:', f'arm_{name}:').replace('stuck:', f'stuck_{name}:')
        compose.write(text, CODE, name)
    # All read one module, so it is written before the first of them starts.
    systems = [compose.run(name) for name in ('first.yaml', 'second.yaml')]
    systems.append(compose.run('third.yaml', '--no-control'))
    for system in systems:
        system.wait_until_ready()
    code, _, errors = composer('reload')
    assert code == 2
    assert errors.endswith('name one of them: first, second\n')
    code, _, errors = composer('reload', 'secnd')
    assert (code, errors.splitlines()[-1]) == (1, "  help: did you mean 'second'?")
    code, listed, _ = composer('ps', 'first', '--format', 'json')
    assert (code, [each['name'] for each in json.loads(listed)['systems']]) == (0, ['first'])
    code, listed, _ = composer('ps', 'fourth')
    assert (code, listed) == (1, '')
    code, _, errors = composer('down', 'third')
    assert (code, errors) == (
        1,
        "error: system 'third' was started with --no-control, and cannot be asked\n",
    )
    code, _, errors = composer('restart', 'arm_frist')
    assert (code, errors.splitlines()[-1]) == (1, "  help: did you mean 'arm_first'?")


def test_a_behaviour_that_hangs_stops_no_answer(compose, composer, peer, wait_for):
    from std_msgs.msg import Empty

    child = compose(SYSTEM + 'diagnostics: {period: 0.1}\n', CODE)
    child.wait_until_ready()
    peer.advertise(Empty, '/trigger').publish(Empty())

    def is_told():
        (told,) = json.loads(composer('ps', '--format', 'json')[1])['systems']
        return told['health'] if told['health']['level'] != 'ok' else None

    wait_for(is_told, 'that it hangs')
    code, _, errors = composer('restart', 'stuck')
    assert code == 1
    assert errors == "system: node 'stuck' hangs, and is left as it is: subscription 'trigger'\n"


def test_those_who_only_pretend_to_be_systems_hide_none(composer, peer):
    from std_srvs.srv import Trigger

    def pretend(name, text):
        def answer(_, response):
            response.message = text
            return response

        peer.run(peer.node.create_service, Trigger, f'/_composer_{name}/status', answer)

    known = {
        'version': 1,
        'name': 'third',
        'file': '',
        'host': '\x1b[31m',
        'state': 'running',
        'pid': 1,
        'uptime_sec': 1,
        'last_error': '',
        'last_reload': None,
        'health': None,
        'components': [],
        'stopped': [],
        'lifecycles': {},
        'awaited': {},
        'external_processes': [],
        'workers': [],
    }
    pretend('first', '{')
    pretend('second', json.dumps({**known, 'nodes': []}))
    pretend('third', json.dumps({**known, 'nodes': ['/a', '/b']}))

    def listed():
        code, output, _ = composer('ps')
        assert code == 0
        return output if output.count('\n') > 3 else None

    # Each call is new on the graph, and a crowded machine may not show it all in time.
    output = wait_for(listed, 'all three')
    assert [line.split()[:3] for line in output.splitlines()[1:]] == [
        ['first', 'unknown', 'answer'],
        ['second', 'wrong', 'name'],
        ['third', 'running', '-'],
    ]
    assert '\x1b' not in output
    assert composer('top', 'first', '--once')[0] == 1


def test_a_system_that_is_ended_by_force_has_stopped(compose, composer):
    text = SYSTEM.replace('  stuck:', '  stuck:\n    on_stop: parts:hang')
    child = compose(text, CODE + '\ndef hang(node):\n    time.sleep(3600)\n')
    child.wait_until_ready()
    # The graph hears of its end only after 20 s.
    assert composer('down', '--timeout', '15') == (0, 'system: stopped\n', '')
    assert child.wait() == 1


SLOW_ACTION = """
version: 1
nodes:
  counter:
    actions:
      count: {type: test_msgs/action/Fibonacci, behaviour: parts:count}
"""
SLOW_CODE = """
import time

def count(node, goal):
    node.logger.info('counting')
    while True:
        time.sleep(0.05)
        yield {'sequence': [0]}
"""


def test_a_goal_in_flight_is_waited_for_until_somebody_does_not_want_to(
    compose, composer, peer, wait_for
):
    pytest.importorskip('test_msgs')
    from action_msgs.msg import GoalStatus
    from rclpy.action import ActionClient
    from std_srvs.srv import Trigger
    from test_msgs.action import Fibonacci

    child = compose(SLOW_ACTION, SLOW_CODE)
    child.wait_until_ready()
    client = peer.run(ActionClient, peer.node, Fibonacci, '/count')
    assert client.wait_for_server(20.0)
    peer.meet_action_server('/count')
    sent = peer.run(client.send_goal_async, Fibonacci.Goal())
    child.wait_for_line('counting')
    wait_for(sent.done, 'its acceptance')
    ended = peer.run(sent.result().get_result_async)
    path = compose.folder / 'system.yaml'
    path.write_text(SLOW_ACTION.replace('count:', 'enumerate:'))
    reload = peer.run(peer.node.create_client, Trigger, '/_composer_system/reload')
    assert reload.wait_for_service(20.0)
    waiting = peer.run(reload.call_async, Trigger.Request())
    child.wait_for_line('waiting for the goals in flight')
    assert not ended.done()
    assert composer('reload', '--now')[0] == 0
    wait_for(lambda: ended.done() and waiting.done(), 'the end of both')
    assert ended.result().status == GoalStatus.STATUS_ABORTED
    assert waiting.result().success
    peer.run(client.destroy)
    assert child.stop() == 0


def test_nodes_stop_and_start(compose, composer, wait_for):
    """What is stopped stays so through reloads; neither stop nor start takes a saved edit."""
    text = (
        SYSTEM.replace('0.5', '20').replace('threads: 1', 'threads: 2')
        + '  far: {worker: other, namespace: robot, timers: {tick: {period: 0.05, behaviour: '
        'parts:far}}, state: {count: 0}}\nworkers: {other: {}}\n'
    )
    code = CODE + '\ndef far(node):\n    node.logger.info("far")\n'
    child = compose(text, code)
    child.wait_until_ready()

    def ask():
        (system,) = json.loads(composer('ps', '--format', 'json')[1])['systems']
        return system['nodes'], system['stopped']

    def restarted():
        return len(child.matching('count 1')), len(child.matching('[robot.far]: far'))

    wait_for(lambda: all(restarted()), 'both')
    assert composer('stop', 'arm') == (0, "system: node '/robot/arm' was stopped\n", '')
    assert composer('stop', 'far')[0] == 0
    assert ask() == (['/stuck'], ['/robot/arm', '/robot/far'])
    assert "node '/robot/arm' is stopped already" in composer('stop', '/robot/arm')[2]
    assert "node '/stuck' runs already" in composer('start', 'stuck')[2]
    assert "node '/robot/arm' is stopped" in composer('restart', 'arm')[2]
    assert 'stopped: /robot/arm, /robot/far' in composer('ps')[1]

    file = compose.folder / 'system.yaml'
    file.write_text(
        text.replace('period: 0.05', 'period: 0.04').replace('count: 0', 'count: 1000')
    )
    assert composer('plan', str(file))[1] == 'system: no difference\n'
    begun = restarted()
    assert composer('start', 'far')[0] == 0
    wait_for(lambda: restarted()[1] > begun[1], 'the node of the worker')
    assert composer('reload')[0] == 0
    assert ask()[1] == ['/robot/arm']
    assert restarted()[0] == begun[0]
    assert composer('start', 'arm')[0] == 0
    assert ask()[1] == []
    child.wait_for_line('count 1001')
    assert child.stop() == 0, child.output


def test_what_has_not_started_is_told_with_what_it_waits_for(compose, composer, peer, wait_for):
    from std_srvs.srv import Trigger

    text = """
        version: 1
        nodes:
          late: {wait_for: {service: '/map', timeout: 3600}}
          slow: {delay: 3600}
          far: {worker: w, wait_for: {topic: scan, timeout: 3600}}
        processes: {driver: {command: [sleep, '600'], wait_for: {node: late, timeout: 3600}}}
    """
    child = compose(text)

    def awaited():
        systems = json.loads(composer('ps', '--format', 'json')[1])['systems']
        return systems[0]['awaited'] if systems else {}

    wait_for(lambda: len(awaited()) == 4, awaited)
    assert awaited() == {
        '/late': "service '/map'",
        '/slow': 'its delay of 3600 s',
        '/far': "a publisher of '/scan'",
        "process 'driver'": "node '/late'",
    }
    told = composer('ps')[1]
    assert "system: not started: process 'driver' waits for node '/late', /late waits for" in told
    peer.run(peer.node.create_service, Trigger, '/map', lambda _, response: response)
    wait_for(lambda: set(awaited()) == {'/slow', '/far'}, awaited)
    assert child.stop(once_up=False) == 130
