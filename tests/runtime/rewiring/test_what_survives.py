"""What an edit takes up and what survives it, as a plain node sees it: one system, many edits."""

import json
from itertools import pairwise

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import Trigger

from tests.running import wait_for

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
# New code of what waits for a response waits for it as long.
executor: {shutdown_timeout: 1}
nodes:
  clock:
    state: {steps: [], once: 0}
    parameters:
      speed: {default: 1.0, minimum: 0.0, maximum: 10.0}
      mode: {default: slow, choices: [slow, fast]}
      size: 1
    parameter_files: [sizes.yaml]
    publishers: {ticks: {type: std_msgs/msg/Int32, external: true}}
    timers:
      tick: {period: 0.02, publish: ticks, message: 3}
      steps: {period: 0.02, behaviour: parts:steps}
      once: {period: 0.02, behaviour: parts:once}
    services:
      probe: {type: std_srvs/srv/Trigger, service: ~/probe, behaviour: probes:probe}
      read: {type: std_srvs/srv/Trigger, service: /read, behaviour: library.use:read}
  caller:
    state: {answers: []}
    service_clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
    timers:
      call: {period: 0.02, behaviour: parts:call}
      call_async: {period: 0.02, behaviour: parts:call_async, group: other}
    services:
      probe: {type: std_srvs/srv/Trigger, service: ~/probe, group: own, behaviour: probes:probe}
  ear:
    state: {heard: ''}
    subscriptions:
      ticks: {type: std_msgs/msg/Int32, behaviour: parts:hear}
    services:
      probe: {type: std_srvs/srv/Trigger, service: ~/probe, behaviour: probes:probe}
"""
CODE = """\
FIRST = 0


def steps(node):
    number = FIRST
    while True:
        number += 1
        node.state.steps.append(number)
        yield


def once(node):
    node.state.once += 1
    yield


def call(node):
    try:
        node.state.answers.append(node.call('ask', None, timeout=None).message)
    except Exception as error:
        node.state.answers.append(str(error))
    yield


async def call_async(node):
    try:
        response = await node.call_async('ask', None, timeout=None)
        node.state.answers.append(response.message)
    except Exception as error:
        node.state.answers.append(str(error))
    yield


def hear(node, message):
    node.state.heard = type(message).__name__
"""
SIZES = '/clock: {ros__parameters: {size: 7}}'
PROBES = """\
import json
from itertools import pairwise


def probe(node, request):
    return {'success': True, 'message': json.dumps(vars(node.state), default=repr)}
"""
# Modules that import each other in each way that there is.
LIBRARY = {
    'library/use.py': """\
import json
from itertools import pairwise

import library.deep
from library.alone import Kept
from library.base import Box, helper
from library.star import *

count = 0


def read(node, request):
    global count
    from library import late

    count += 1
    state, base = node.state, library.base
    state.box = getattr(state, 'box', None) or Box()
    state.kept = getattr(state, 'kept', None) or Kept()
    found = {
        'helper': helper(),
        'late': late.VALUE,
        'deep': library.deep.inner.VALUE,
        'star': STAR,
        'count': count,
        'number': state.box.number,
        'kept': isinstance(state.kept, Kept),
        'extra': hasattr(base, 'EXTRA'),
        'one': base.Box is Box,
    }
    return {'success': True, 'message': json.dumps(found)}
""",
    'library/base.py': """\
EXTRA = 1


class Box:
    number = 1


def helper():
    return 'old helper'
""",
    'library/late.py': "VALUE = 'old late'\n",
    'library/alone.py': 'class Kept:\n    pass\n',
    'library/star.py': "STAR = 'old star'\n",
    'library/deep/__init__.py': 'from . import inner\n',
    'library/deep/inner.py': "VALUE = 'old inner'\n",
}


@pytest.fixture(scope='module')
def running(shared_compose, shared_peer):
    (shared_compose.folder / 'probes.py').write_text(PROBES)
    (shared_compose.folder / 'sizes.yaml').write_text(SIZES)
    (shared_compose.folder / 'library' / 'deep').mkdir(parents=True)
    for name, text in LIBRARY.items():
        (shared_compose.folder / name).write_text(text)
    shared_compose(SYSTEM, CODE).wait_until_ready()
    return Edited(shared_compose.folder, shared_peer)


@pytest.fixture
def edited(running):
    """Return the system as its files were at first."""
    yield running
    running.go_back()


class Edited:
    """A running system, edits of its files, and what a plain node sees of it."""

    def __init__(self, folder, peer):
        self.folder = folder
        self._peer = peer
        self._texts = {
            str(path.relative_to(folder)): path.read_text()
            for kind in ('*.py', '*.yaml')
            for path in folder.rglob(kind)
        }
        self._clients = {}
        # Its ends are found in the order in which they are made: when the last one has an answer,
        # none of the services that must not be called twice answers into the void.
        self._client(SetParametersAtomically, '/_composer_system/restart')
        self._client(Trigger, '/_composer_system/reload')
        self.call(Trigger, '/_composer_system/plan')

    def edit(self, replacements):
        """Replace texts in the files; return what was planned, and what was done."""
        found = set()
        texts = dict(self._texts)
        for old, new in replacements.items():
            for name, text in texts.items():
                if old in text:
                    found.add(old)
                    texts[name] = text.replace(old, new)
        assert found == set(replacements)
        for name, text in texts.items():
            if (self.folder / name).read_text() != text:
                (self.folder / name).write_text(text)
        return self.call(Trigger, '/_composer_system/plan').message, self.reload()

    def reload(self):
        response = self.call(Trigger, '/_composer_system/reload')
        return response.message[response.message.rfind('\n') + 1 :]

    def go_back(self):
        for name, text in self._texts.items():
            if (self.folder / name).read_text() != text:
                (self.folder / name).write_text(text)
        self.reload()

    def probe(self, node):
        """Return the state of a node."""
        return json.loads(self.call(Trigger, f'/{node}/probe').message)

    def read(self):
        """Return what a behaviour finds in the modules of the library."""
        return json.loads(self.call(Trigger, '/read').message)

    def see_clock(self):
        """Return the IDs of the subscriptions to `/clock`."""
        found = self._peer.node.get_subscriptions_info_by_topic('/clock')
        return [bytes(end.endpoint_gid) for end in found]

    def get(self, name):
        """Return the value of a parameter of the clock."""
        (value,) = self.call(GetParameters, '/clock/get_parameters', names=[name]).values
        return parameter_value_to_python(value)

    def set(self, name, value):
        """Set a parameter of the clock; return why it was refused."""
        parameters = [Parameter(name, value=value).to_parameter_msg()]
        answer = self.call(SetParameters, '/clock/set_parameters', parameters=parameters)
        return answer.results[0].reason

    def restart(self):
        """Build the clock anew."""
        parameters = [Parameter('node', value='/clock').to_parameter_msg()]
        answer = self.call(
            SetParametersAtomically, '/_composer_system/restart', parameters=parameters
        )
        assert answer.result.successful

    def call(self, service_class, name, /, **fields):
        client = self._client(service_class, name)
        (response,) = self._peer.call_by([client], service_class.Request(**fields))
        return response

    def _client(self, service_class, name):
        if name not in self._clients:
            client = self._peer.run(self._peer.node.create_client, service_class, name)
            self._clients[name] = client
        return self._clients[name]


@pytest.mark.parametrize(
    ('replacements', 'done', 'type_name'),
    [
        ({'Int32': 'Int64'}, '±1 publisher, ±1 subscription', 'Int64'),
        # An end of a node that comes, goes, or is renamed is in the way, too.
        ({'Int32': 'Int64', '  ear:': '  ear2:'}, '±1 publisher, -1 node, +1 node', None),
    ],
)
def test_a_topic_gets_another_type(edited, replacements, done, type_name):
    wait_for(lambda: edited.probe('ear')['heard'] == 'Int32', 'a message')
    _, said = edited.edit(replacements)
    counts = said.partition('ms: ')[2].split(', ')
    assert sorted(counts) == sorted(done.split(', '))
    if type_name:
        wait_for(lambda: edited.probe('ear')['heard'] == type_name, f'an {type_name}')


def test_a_topic_keeps_its_type_if_something_else_fails(edited):
    failing = {'Int32': 'Int64', '  ear:': '  late: {on_start: parts:fail}\n  ear:'}
    (edited.folder / 'parts.py').write_text(CODE + '\n\ndef fail(node):\n    raise OSError\n')
    _, said = edited.edit(failing)
    assert said.startswith('not reloaded: ')
    wait_for(lambda: edited.probe('ear')['heard'] == 'Int32', 'a message')


def test_a_generator_goes_on_unless_its_code_is_new(edited):
    wait_for(lambda: edited.probe('clock')['steps'], 'a step')
    before = edited.probe('clock')['steps']
    edited.edit({'steps: {period: 0.02': 'steps: {period: 0.01'})
    edited.edit({'steps: {period: 0.02': 'steps: {period: 0.01, warn_after: 2.0'})
    wait_for(lambda: len(edited.probe('clock')['steps']) > len(before) + 2, 'more steps')
    assert edited.probe('clock')['steps'][len(before)] == before[-1] + 1
    edited.edit({'FIRST = 0': 'FIRST = 1000'})
    wait_for(lambda: edited.probe('clock')['steps'][-1] > 1000, 'steps of the new code')
    # One that has ended has nothing more to do.
    assert edited.probe('clock')['once'] == 1


_STAYS = 'the value that was set while it ran stays'


@pytest.mark.parametrize(
    ('live', 'replacements', 'name', 'value', 'note'),
    [
        (None, {'speed: {default: 1.0': 'speed: {default: 2.0'}, 'speed', 2.0, ''),
        (5.0, {'speed: {default: 1.0': 'speed: {default: 2.0'}, 'speed', 5.0, _STAYS),
        # Also if it is the value that the file has.
        (1.0, {'speed: {default: 1.0': 'speed: {default: 2.0'}, 'speed', 1.0, _STAYS),
        (5.0, {'default: 1.0, minimum: 0.0, maximum: 10.0': 'default: fast'}, 'speed', 'fast', ''),
        (None, {'size: 7': 'size: 8'}, 'size', 8, ''),
        (None, {'{size: 7}': '{}'}, 'size', 1, ''),
        (70, {'size: 1': 'size: 1.0', 'size: 7': 'size: 7.5'}, 'size', 7.5, ''),
    ],
)
def test_parameters_follow_the_files_unless_somebody_has_set_them(
    edited, live, replacements, name, value, note
):
    edited.restart()
    if live is not None:
        assert not edited.set(name, live)
    planned, said = edited.edit(replacements)
    assert said.startswith('reloaded in ')
    assert edited.get(name) == value
    assert (_STAYS in planned) == bool(note)


@pytest.mark.parametrize(
    ('name', 'live', 'replacements', 'reason'),
    [
        ('speed', 9.0, {'maximum: 10.0': 'maximum: 5.0'}, 'out of range'),
        ('mode', 'fast', {'[slow, fast]': '[slow]'}, "'fast' is not one of slow"),
    ],
)
def test_a_declaration_that_a_live_value_does_not_fit_is_refused(
    edited, name, live, replacements, reason
):
    edited.restart()
    assert not edited.set(name, live)
    _, said = edited.edit({**replacements, 'size: 7': 'size: 9'})
    assert said.startswith('not reloaded: ')
    assert reason in said
    assert (edited.get(name), edited.get('size')) == (live, 7)
    # The old declaration holds, too.
    assert not edited.set(name, live)
    assert edited.set('mode', 'backwards') == "'backwards' is not one of slow, fast"


def test_values_set_live_survive_a_new_node_that_cannot_start(edited):
    edited.restart()
    edited.set('speed', 4.0)
    failing = {'  clock:': '  clock:\n    rosout: false\n    on_start: parts:nothing'}
    code = {'FIRST = 0': 'FIRST = 0\n\n\ndef nothing(node):\n    raise OSError\n'}
    _, said = edited.edit({**failing, **code})
    assert said.startswith("not reloaded: node 'clock': on_start raised OSError")
    assert edited.get('speed') == 4.0


def test_clocks_and_parameter_files_stay_if_something_else_fails(edited):
    clock = {'  clock:': '  clock:\n    use_sim_time: true'}
    edited.edit(clock)
    (before,) = wait_for(edited.see_clock, 'the subscription to /clock')
    failing = {
        'FIRST = 0': 'FIRST = 0\n\n\ndef fail(change, changes):\n    return "no"\n',
        '  ear:': '  ear:\n    use_sim_time: true\n    on_parameters: parts:fail',
        'size: 7': 'size: 9, use_sim_time: false',
    }
    _, said = edited.edit({**clock, **failing})
    assert said == "not reloaded: parameter 'use_sim_time' of 'ear': no"
    assert edited.see_clock() == [before]
    # Also if the node itself is created again, as the files said.
    _, said = edited.edit({**failing, '  clock:': '  clock:\n    rosout: false'})
    assert said.startswith('not reloaded: ')
    assert (edited.get('size'), edited.get('use_sim_time')) == (7, True)


@pytest.mark.parametrize(
    ('replacements', 'changes'),
    [
        (
            {"'old helper'": "'new helper'", 'EXTRA = 1\n': ''},
            {'helper': 'new helper', 'extra': False},
        ),
        ({"'old late'": "'new late'"}, {'late': 'new late'}),
        ({"'old star'": "'new star'"}, {'star': 'new star'}),
        ({"'old inner'": "'new inner'"}, {'deep': 'new inner'}),
        # What is kept is of the class that it was made of.
        ({'number = 1': 'number = 2'}, {}),
        ({'    pass\n': '    """New."""\n'}, {'kept': False}),
    ],
)
def test_modules_are_new_with_all_that_import_them(edited, replacements, changes):
    edited.restart()
    before = edited.read()
    _, said = edited.edit(replacements)
    assert said.startswith('reloaded in '), said
    assert edited.read() == before | changes | {'count': 1}


def test_a_module_that_raises_changes_nothing(edited):
    before = edited.read()
    _, said = edited.edit({"'old inner'": "'new inner' if 1 / 0 else ''"})
    assert said.startswith('not reloaded: ')
    assert edited.read() == before | {'count': before['count'] + 1}


def test_calls_end_when_their_client_goes_and_only_then(edited):
    edited.edit({'period: 0.02, publish': 'period: 0.03, publish'})
    assert edited.probe('caller')['answers'] == []
    planned, _ = edited.edit({'ask: {type': 'ask: {service: other, type'})
    assert 'lost: responses that calls wait for' in planned
    wait_for(lambda: len(edited.probe('caller')['answers']) == 2, 'the ends of both calls')
    (answer,) = set(edited.probe('caller')['answers'])
    assert answer == "an edit took the client of '/ask' away, which this call waited for"


COUNTING = """
import gc

STEP = {step}


def tick(node):
    node.state.count = STEP
    return str(STEP)


def hear(node, message):
    node.state.heard = message.data


def count(node, request):
    gc.collect()
    return {{'success': True, 'message': str(len(gc.get_objects()))}}
"""


def test_reloads_leave_nothing_behind(compose, peer):
    """Whatever is edited, as many objects are there afterwards: counted, not weighed."""

    def write(step):
        edited = {
            'parameters': {'step': step},
            'state': {'count': 0, 'heard': ''},
            'publishers': {'out': 'std_msgs/msg/String'},
            'timers': {
                'tick': {'period': 0.05 + step / 100, 'behaviour': 'parts:tick', 'publish': 'out'}
            },
            'subscriptions': {
                'out': {
                    'type': 'std_msgs/msg/String',
                    'behaviour': 'parts:hear',
                    'qos': 5 + step,
                }
            },
        }
        counter = {
            'services': {'count': {'type': 'std_srvs/srv/Trigger', 'behaviour': 'parts:count'}}
        }
        nodes = {'counter': counter, 'edited': edited} | ({'more': edited} if step else {})
        text = json.dumps({'version': 1, 'diagnostics': False, 'nodes': nodes})
        for name, content in (('parts.py', COUNTING.format(step=step)), ('system.yaml', text)):
            beside = compose.folder / f'{name}.new'
            beside.write_text(content)
            beside.replace(compose.folder / name)

    def reload(times):
        for _ in range(times):
            for step in (1, 0):
                write(step)
                assert peer.call(Trigger, '/_composer_system/reload').success

    def count():
        # What a reload or a call has just let go of goes with the next one.
        return min(int(peer.call(Trigger, '/count').message) for _ in range(5))

    write(0)
    child = compose.run('system.yaml')
    child.wait_until_ready()
    reload(1)
    counts = [count()]
    for _ in range(3):
        reload(4)
        counts.append(count())
    # One object that each of the 8 reloads leaves would be as many. What is made once and kept,
    # as for a log line or a peer that is found late, is not there after each of three rounds.
    assert min(after - before for before, after in pairwise(counts)) < 8, (counts, child.output)
    assert child.stop() == 0
