"""`on_exit`, `delay`, and waiting for the end of a process: what starts when, and what stops."""

import json
import signal

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
def starts(node):
    node.logger.info('starts')

def report(process, exit_code, text='ended'):
    process.logger.info(f'{process.name} {text} with {exit_code}')

async def report_later(process, exit_code):
    report(process, exit_code, 'async')

def fail(process, exit_code):
    raise OSError('no such device')

def end_all(process, exit_code):
    process.shutdown(exit_code)

def hang(process, exit_code):
    import time
    process.logger.info('hangs')
    time.sleep(1000)
"""
SLEEP = ['sleep', '3600']


def shell(command):
    return ['sh', '-c', command]


def system(processes, **nodes):
    """Return a system in JSON, which is YAML."""
    data = {'version': 1, 'diagnostics': False, 'executor': {'shutdown_timeout': 2}}
    return json.dumps(data | {'processes': processes, 'nodes': nodes})


def test_all_that_an_end_is_for_is_done_in_order(compose):
    processes = {
        'homing': {
            'command': shell('exit 3'),
            'restart': {'max': 1, 'delay': 0},
            'on_exit': [
                'parts:report',
                'parts:report_later',
                'parts:fail',
                {'behaviour': 'parts:report', 'with': {'text': 'over'}},
                {'start': 'mission'},
            ],
        },
        'mission': {'command': shell('echo begun'), 'on_exit': [{'start': 'last'}, 'shutdown']},
        'last': {'command': SLEEP, 'delay': 0.1, 'on_exit': 'parts:fail'},
    }
    child = compose(system(processes, n={}), CODE)

    assert child.wait() == 0
    told = [
        'started again in 0.1 s',
        'homing ended with 3',
        'homing async with 3',
        "on_exit of process 'homing' (system.yaml:1) raised OSError: no such device",
        'homing over with 3',
        '[mission] begun',
        "process 'mission' has ended with exit code 0, so the system ends",
        "process 'last' was ended by SIGINT",
    ]
    at = [child.lines.index(child.wait_for_line(each)) for each in told]
    assert at == sorted(at)
    assert len(child.matching('homing ended')) == len(child.matching("process 'mission'")) == 1


def test_a_state_of_a_process_is_waited_for(compose):
    processes = {
        'good': {'command': shell('exit 0')},
        'bad': {'command': shell('exit 3')},
        'lasting': {'command': SLEEP},
    }
    states = {'good': 'succeeded', 'bad': 'ended', 'lasting': 'running'}
    nodes = {
        f'n_{name}': {
            'wait_for': {'process': name, 'state': state},
            'on_start': 'parts:starts',
        }
        for name, state in states.items()
    }
    child = compose(system(processes, **nodes), CODE)
    child.wait_until_ready()
    assert len(child.matching(']: starts')) == len(nodes)
    assert child.stop() == 0


def test_a_state_that_cannot_come_ends_the_start(compose):
    processes = {
        'homing': {'command': shell('exit 3')},
        'after': {'command': SLEEP, 'wait_for': {'process': 'homing', 'state': 'ended'}},
    }
    waits = [{'process': 'homing', 'state': 'succeeded'}, {'process': 'after'}]
    child = compose(system(processes, n={'wait_for': waits, 'on_start': 'parts:starts'}), CODE)

    child.wait_for_line(
        "node 'n' (system.yaml:1) waits for the process 'homing' to succeed: "
        'it has ended with exit code 3'
    )
    assert child.wait() == 1


def test_a_stop_ends_a_delay(compose):
    processes = {'late': {'command': SLEEP, 'delay': 3600}, 'now': {'command': shell('echo now')}}
    child = compose(system(processes, n={'delay': 3600, 'on_start': 'parts:starts'}), CODE)
    child.wait_for_line('[now] now')

    assert child.stop(signal.SIGTERM, once_up=False) == 0
    assert not child.matching('starts')


def test_what_ends_last_ends_a_system_without_nodes(compose):
    processes = {
        'first': {'command': ['true'], 'on_exit': {'start': 'second'}},
        'second': {'command': shell('exit 1'), 'delay': 0.1},
        'never': {'command': ['true']},
        'hopeless': {'command': SLEEP, 'wait_for': {'process': 'second', 'state': 'succeeded'}},
    }
    processes['second']['on_exit'] = {'start': 'hopeless'}
    child = compose(system(processes))

    assert child.wait() == 1
    child.wait_for_line("process 'hopeless' (system.yaml:1) waits for the process 'second' to")
    child.wait_for_line('all processes have ended: the system ends')


@pytest.mark.parametrize(('action', 'code'), [('parts:end_all', 3), ('parts:hang', 1)])
def test_a_behaviour_may_end_the_system_and_cannot_keep_it(compose, action, code):
    child = compose(system({'it': {'command': shell('exit 3'), 'on_exit': action}}, n={}), CODE)
    if action == 'parts:hang':
        child.wait_for_line('hangs')
        child.wait_until_ready()
        child.send(signal.SIGINT)

    assert child.wait() == code
    if action == 'parts:hang':
        child.wait_for_line("on_exit of process 'it' did not end in time; it is at")


def test_an_edit_ends_a_delay_and_changes_what_an_end_is_for(compose):
    processes = {
        'homing': {'command': shell('until [ -e go ]; do sleep 0.02; done')},
        'mission': {'command': shell('echo begun; exec sleep 3600')},
    }

    def edit(**nodes):
        beside = compose.folder / 'system.new'
        beside.write_text(system(processes, **nodes))
        beside.replace(compose.folder / 'system.yaml')

    child = compose(system(processes, n={}), CODE, '--watch')
    child.wait_until_ready()
    child.wait_for_line('[mission] begun')
    edit(n={}, late={'delay': 3600})
    child.wait_for_line('[late]: Waiting for its delay of 3600 s…')
    processes['homing']['on_exit'] = [{'start': 'mission'}, 'parts:report']
    edit(n={})
    # It starts when the other one has ended, and so it ends now.
    child.wait_for_line("process 'mission' was ended by SIGINT")
    child.wait_for_line('reloaded in ')
    (compose.folder / 'go').touch()
    child.wait_for_line('[mission] begun', times=2)
    child.wait_for_line('homing ended with 0')
    assert child.stop() == 0
