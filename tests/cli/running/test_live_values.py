"""`composer echo`, `call`, `send-goal` and `set`, against one running system."""

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run as run_command
from tests.running import wait_for

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  talker:
    state: {count: 0}
    parameters:
      gain: {default: 1.0, minimum: -2.0, maximum: 5.0}
      steps: {default: [1.0, 2.0]}
    publishers: {scan: sensor_msgs/msg/LaserScan}
    timers: {scan: {rate: 20, behaviour: 'parts:scan', publish: scan}}
    services: {add: {type: test_msgs/srv/BasicTypes, behaviour: 'parts:add'}}
    actions: {count: {type: test_msgs/action/Fibonacci, behaviour: 'parts:count'}}
"""
CODE = """
def scan(node):
    return {'header': {'frame_id': 'base: no'}, 'ranges': [0.5, float('inf')] * 100}

def add(node, request):
    return {'int64_value': request.int64_value + round(node.parameters.gain)}

def count(node, goal):
    if goal.order < 0:
        raise ValueError('negative')
    for number in range(goal.order):
        node.sleep(0.02)
        yield {'sequence': list(range(number))}
    return {'sequence': [goal.order]}
"""


@pytest.fixture(scope='module')
def domain(shared_compose):
    """Return the domain in which the system runs."""
    child = shared_compose(SYSTEM, CODE)
    child.wait_until_ready()
    yield str(shared_compose.domain_id)
    assert child.stop() == 0


@pytest.fixture
def run(domain, monkeypatch, capsys):
    """Return a function that runs a command beside the system: its exit code and outputs."""
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)

    def run(*words):
        # A tilde stands for a space.
        code = run_command([each.replace('~', ' ') for each in words])
        return (code, *capsys.readouterr())

    return run


@pytest.mark.parametrize(
    ('words', 'printed'),
    [
        ('echo scan ranges[1] --once', '.inf\n'),
        (
            'send-goal /count {order:~2}',
            'sequence: []\n---\nsequence: [0]\n---\nsequence: [2]\n---\n',
        ),
        ('set /talker steps [3,~4.5]', ''),
    ],
)
def test_what_is_there_is_printed(run, words, printed):
    assert run(*words.split()) == (0, printed, '')


def test_messages_are_yaml_and_long_arrays_are_cut(run):
    code, out, _ = run('echo', '/scan', '--once')
    assert code == 0
    assert out.startswith('header:\n  stamp:\n    sec: 0\n')
    assert '  frame_id: "base: no"\n' in out
    assert out.endswith('intensities: []\n---\n')
    assert '.inf, 0.5, .inf, "… 72 more"]\n' in out


def test_a_parameter_that_is_set_governs_the_next_call(run):
    assert run('set', 'talker', 'gain', '-2') == (0, '', '')
    code, out, err = run('call', 'add', '{int64_value: 41}')
    assert (code, err) == (0, '')
    assert '\nint64_value: 39\n' in out


@pytest.mark.parametrize(
    ('words', 'code', 'told'),
    [
        ('echo scna', 1, ["no topic '/scna'", "did you mean '/scan'?"]),
        ('echo scan rangs', 1, ["no field 'rangs'", "did you mean 'ranges'?"]),
        ('call add {int64_value:', 2, ['is no YAML']),
        ('send-goal count -- -1', 1, ['the goal was aborted']),
        ('set talker gain 9', 1, ["'/talker' refuses gain = 9", 'out of range']),
    ],
)
def test_what_is_wrong_is_told_with_a_way_out(run, words, code, told):
    words = words.split()
    # What is not there is not waited for; what is there may be found late.
    limit = ['--timeout', '4' if told[-1].startswith("did you mean '/") else '40']
    found, _, err = run(*words[:1], *limit, *words[1:])
    assert (found, 'Traceback' in err) == (code, False)
    for each in told:
        assert each in err


@pytest.mark.parametrize(
    ('words', 'line', 'code'),
    [
        (['echo', 'scan', '--hz'], ' Hz: ', 0),
        (['send-goal', 'count', '100000'], 'sequence: ', 1),
    ],
)
def test_an_interrupt_ends_it(domain, shared_compose, words, line, code):
    child = shared_compose.start(*words)
    child.wait_for_line(line)
    assert child.stop() == code
    told = ['canceling the goal', 'the goal was canceled'] if code else []
    assert child.matching('the goal') == told


def test_the_shell_completes_names(run, monkeypatch):
    for words, name in (('echo sc', '/scan'), ('set', '/talker')):
        monkeypatch.setenv('COMP_WORDS', f'composer {words}')
        monkeypatch.setenv('COMP_CWORD', str(words.count(' ') + 1 + (words == 'set')))
        monkeypatch.setenv('_COMPOSER_COMPLETE', 'bash_complete')
        wait_for(lambda name=name: f'plain,{name}\n' in run()[1], f'{name} to be offered')
