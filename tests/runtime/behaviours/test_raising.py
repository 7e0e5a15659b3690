"""Whatever a behaviour raises, wherever it is bound: it is told like any error."""

import re
from itertools import cycle

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

ERRORS = {
    'interrupt': 'KeyboardInterrupt: ',
    'exit': 'SystemExit: 5',
    'recursion': 'RecursionError: maximum recursion depth exceeded',
    'generator_exit': 'GeneratorExit: gone',
    'mute': 'Mute: <its __str__ raised ZeroDivisionError>',
    'unsayable': r'ValueError: \udcff\x00',
}

CODE = """
class Mute(Exception):
    def __str__(self):
        return 1 // 0

def deeper(error):
    deeper(error)

def fail(error):
    if error == 'interrupt':
        raise KeyboardInterrupt
    if error == 'exit':
        raise SystemExit(5)
    if error == 'recursion':
        deeper(error)
    if error == 'generator_exit':
        raise GeneratorExit('gone')
    if error == 'mute':
        raise Mute
    if error == 'unsayable':
        raise ValueError(chr(0xdcff) + chr(0))

def plain(node, *_, error):  # composer: ignore[field-type]
    fail(error)

def generator(node, *_, error):
    yield
    fail(error)

async def coroutine(node, *_, error):  # composer: ignore[field-type]
    fail(error)

async def async_generator(node, *_, error):
    yield
    fail(error)

def live(node):
    node.logger.info('alive')

def serve(node, request):
    return {'success': True}

"""


def own_frames(child):
    return [line for line in child.lines if re.search(r'File ".*/composer/\w+', line)]


def test_a_timer_may_raise_anything_and_ticks_on(compose):
    kinds = ('plain', 'generator', 'coroutine', 'async_generator')
    lines = ['version: 1', 'nodes:']
    places = {}
    for kind in kinds:
        lines += [f'  {kind}:', '    timers:']
        for name in ERRORS:
            lines.append(
                f"      {name}: {{period: 0.1, behaviour: 'parts:{kind}', with: {{error: {name}}}}}"
            )
            places[kind, name] = len(lines)
    lines.append("  good: {timers: {live: {period: 0.02, behaviour: 'parts:live'}}}\n")
    child = compose('\n'.join(lines), CODE)
    for (kind, name), line in places.items():
        child.wait_for_line(
            f"[ERROR] [{kind}]: timer '{name}' (system.yaml:{line}) raised {ERRORS[name]}"
        )
        child.wait_for_line(f"[{kind}]: timer '{name}'", times=2)
    alive = len(child.matching('alive'))
    child.wait_for_line('alive', times=alive + 3)
    assert child.stop() == 0

    assert not own_frames(child)
    assert child.matching('help: to end the system call node.shutdown()')
    raised = tuple(f'[ERROR] [{kind}]: timer' for kind in kinds)
    assert {line for line in child.lines if line.startswith('[')} == {
        line for line in child.lines if line.startswith((*raised, '[INFO]'))
    }


def test_subscriptions_services_and_parameters_may_raise_anything(compose, peer, wait_for):
    entities = '\n'.join(
        f"""
  on_{name}:
    parameters: {{speed: 1}}
    on_parameters: {{behaviour: 'parts:{kind}', with: {{error: {name}}}}}
    subscriptions:
      number: {{type: std_msgs/msg/Int32, behaviour: 'parts:{kind}', with: {{error: {name}}}}}
    services:
      ask_{name}: {{type: std_srvs/srv/Trigger, behaviour: 'parts:{kind}', with: {{error: {name}}}}}
      answer_{name}: {{type: std_srvs/srv/Trigger, behaviour: 'parts:serve'}}
"""
        for name, kind in zip(ERRORS, cycle(('plain', 'coroutine')))
    )
    child = compose(f'version: 1\nnodes:\n{entities}\n', CODE)
    child.wait_until_ready()
    publisher = peer.advertise(Int32, 'number')
    wait_for(lambda: publisher.get_subscription_count() == len(ERRORS), 'all subscriptions')
    publisher.publish(Int32())
    for name in ERRORS:
        client = peer.run(peer.node.create_client, Trigger, f'ask_{name}')
        assert client.wait_for_service(30)
        client.call_async(Trigger.Request())
    change = Parameter(name='speed', value=ParameterValue(type=2, integer_value=2))
    for name, error in ERRORS.items():
        (result,) = peer.call(
            SetParameters, f'on_{name}/set_parameters', parameters=[change]
        ).results
        assert result.reason == 'on_parameters raised an error'
        for entity in ("subscription 'number'", f"service 'ask_{name}'", 'on_parameters'):
            line = child.wait_for_line(f'[ERROR] [on_{name}]: {entity} (')
            assert f' raised {error}' in line
    answers = peer.call_all(Trigger, [f'answer_{name}' for name in ERRORS])
    assert [answer.success for answer in answers] == [True] * len(ERRORS)
    assert child.stop() == 0

    assert not own_frames(child)
    # A change that is not answered in time is asked for again.
    first = [line for line in child.matching('[ERROR]') if ', last: ' not in line]
    assert len(first) == 3 * len(ERRORS)


def test_on_start_and_on_stop_may_raise_anything(compose):
    stops = '\n'.join(
        f"  {name}: {{on_stop: {{behaviour: 'parts:{kind}', with: {{error: {name}}}}}}}"
        for name, kind in zip(ERRORS, cycle(('plain', 'coroutine')))
    )
    start = "{on_start: {behaviour: 'parts:coroutine', with: {error: exit}}}"
    child = compose(f'version: 1\nnodes:\n{stops}\n  last: {start}\n', CODE)

    assert child.wait() == 1
    assert child.matching(
        f'[ERROR] [last]: on_start (system.yaml:{len(ERRORS) + 3}) raised SystemExit: 5'
    )
    assert child.lines[-1] == "error: node 'last': on_start raised SystemExit(5)"
    for index, (name, error) in enumerate(ERRORS.items()):
        assert child.matching(
            f'[ERROR] [{name}]: on_stop (system.yaml:{index + 3}) raised {error}'
        )
    assert not own_frames(child)


def test_a_huge_error_is_cut(compose):
    text = """
        version: 1
        nodes: {bad: {timers: {fail: {period: 0.02, behaviour: 'parts:fail'}}}}
    """
    code = """
        def fail(node):
            raise ValueError('x' * 3_000_000)
    """
    child = compose(text, code)
    child.wait_for_line('more times')
    child.stop()

    assert len(child.output) < 20_000
    assert child.matching('x … (')


def test_what_composer_raises_on_purpose_shows_the_line_of_the_behaviour_last(compose):
    text = """
        version: 1
        nodes:
          bad:
            publishers: {words: std_msgs/msg/String}
            timers: {fail: {period: 0.02, behaviour: 'parts:fail'}}
    """
    code = """
        def fail(node):
            name = 'wrods'  # composer: ignore[unknown-publisher]
            node.publish(name, 'hello')
    """
    child = compose(text, code)
    line = child.wait_for_line('raised UndeclaredError')
    child.wait_for_line('help: ')
    begin = child.lines.index(line)

    assert child.lines[begin + 1 : begin + 6] == [
        '  Traceback (most recent call last):',
        f'    File "{compose.folder}/parts.py", line 4, in fail',
        "      node.publish(name, 'hello')",
        "  composer.runtime.nodes.behaviour_node.UndeclaredError: node 'bad' declares no publisher 'wrods'",
        "  help: did you mean 'words'?",
    ]


def test_errors_are_counted_exactly_and_told_at_most_once_a_second(compose):
    text = """
        version: 1
        nodes: {bad: {timers: {fail: {period: 0.005, behaviour: 'parts:fail'}}}}
    """
    code = """
        def fail(node):
            node.state.times = getattr(node.state, 'times', 0) + 1
            if node.state.times == 400:
                node.shutdown()
            if node.state.times <= 400:
                raise ValueError(node.state.times)
    """
    child = compose(text, code)
    assert child.wait() == 0

    said = child.matching('[bad]: timer')
    counts = [int(line.split()[6]) for line in said if ' more times' in line]
    once = len(child.matching(' raised once more, '))
    assert sum(counts) + once + len(child.matching(' raised ValueError: ')) == 400
    assert said[-1].startswith("[ERROR] [bad]: timer 'fail' (system.yaml:3) raised ")
    assert said[-1].endswith(', last: ValueError: 400')
    assert len(child.matching('Traceback')) == 1
