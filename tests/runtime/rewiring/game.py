"""A game: random edits of a running system, after each of which all of it is compared."""

import os
import random
import sys
from contextlib import ExitStack, contextmanager
from time import monotonic, sleep
from unittest import mock

import pytest
from rclpy.parameter import Parameter

from composer.errors import StartError
from composer.planning.differences import compare
from composer.planning.plan import Action
from composer.runtime import system as system_module
from composer.runtime.rewiring.rewire import Rewiring
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.descriptions import describe, describe_bound, ros_of
from tests.runtime.rewiring.edits import Project
from tests.runtime.rewiring.fresh_start import (
    FreshStarter,
    create_parameter_services,
    running_system,
)
from tests.runtime.rewiring.memories import find_lost, remember
from tests.runtime.rewiring.observing import Observer, see_graph

# What only a system that runs can have against an edit.
_OWN_REASONS = (
    'cannot change while the system runs',
    'its value was set while the system ran',
    ': no',  # What `decide` returns.
)
# After steps of these a failure strikes.
_STEPS = ('_begin', '_change_entity', '_change_node', '_replace_record', '_end_nodes')
_PROMPT_NS = 200_000_000
_WITNESS = '/witness'


class Game:
    """A running system, its files, and all that it is compared with.

    Attributes:
        applied: How many edits have changed the system.
    """

    def __init__(self, project, seed, system, reloader, fresh, observer, checked):  # noqa: PLR0913, PLR0917
        self._project = project
        self._random = random.Random(seed)
        self._system = system
        self._reloader = reloader
        self._fresh = fresh
        self._observer = observer
        self._checked = checked
        # What was set while the system ran, by its node and parameter.
        self._live = {(_WITNESS, 'level'): '7'}
        self._plan = None
        self.applied = 0
        project.keep()

    def play(self, done=None):
        """Edit, reload, and compare; return the edits, and what came of them."""
        done = self._project.edit() if done is None else done
        self._project.write()
        self._set_live(done)
        self._before = describe(self._system)
        self._kept = remember(self._system)
        self._gids = see_graph(self._observer.node)[1]
        self._old = self._system.snapshot
        self._plan = None
        with self._failing(done):
            outcome = self._reloader.reload(self._system)
        text = outcome.text.splitlines()[-1]
        assert not self._system.stop_requested, done
        create_parameter_services(self._system)
        if 'a fault of the game' in text:
            self._check_refused(done, text)
            outcome = self._reloader.reload(self._system)
            text = outcome.text.splitlines()[-1]
        if not outcome.succeeded:
            if self._plan is not None and not any(each in text for each in _OWN_REASONS):
                self._fresh.begin(checks=True)
                assert isinstance(self._fresh.result(), str), f'{done}: only refused: {text}'
            self._check_refused(done, text)
            self._project.go_back()
            return done, text
        plan = compare(self._old, self._system.snapshot)
        # It has passed the check in this process, as it does in any other.
        self._fresh.begin(checks=self._random.random() < self._checked)
        try:
            self._forget_live(plan)
            self._check_untouched(plan.operations, done)
            self._check_runs(plan, done)
        finally:
            fresh = self._fresh.result()
        if isinstance(fresh, str):
            # It counts from the next start: this system would not survive one.
            assert 'on_start raised' in fresh or 'waited' in fresh or 'wait' in fresh, (done, fresh)
            self._project.go_back()
            self._project.write()
            assert self._reloader.reload(self._system).succeeded, done
            return done, f'would not start: {fresh}'
        self._check_equal(*fresh, done)
        self.applied += bool(plan)
        self._project.keep()
        return done, text

    @contextmanager
    def _failing(self, done):
        """Let one step of the reload fail now and then, after it was done; and see the plan."""
        left = self._random.choice([0] * 6 + [1, 2, 3, 5])

        def counting(original):
            def step(*arguments):
                nonlocal left
                result = original(*arguments)
                left -= 1
                if left == 0:
                    message = 'a fault of the game'
                    raise StartError(message)
                return result

            return step

        def seeing(old, new):
            self._plan = compare(old, new)
            return self._plan

        if left:
            done.append(f'(fails at step {left})')
        with ExitStack() as stack:
            stack.enter_context(mock.patch.object(system_module, 'compare', seeing))
            for name in _STEPS if left else ():
                step = counting(getattr(Rewiring, name))
                stack.enter_context(mock.patch.object(Rewiring, name, step))
            yield

    def _set_live(self, done):
        """Set a parameter or a value of the state now and then."""
        nodes = [node for name, node in self._system._nodes.items() if name != _WITNESS]
        if not nodes or self._random.random() < 0.7:
            return
        node = self._random.choice(nodes)
        if vars(node.behaviour_node.state):
            key = self._random.choice(sorted(vars(node.behaviour_node.state)))
            setattr(node.behaviour_node.state, key, f'live {self.applied}')
        names = sorted(node.spec.parameters)
        name = self._random.choice(names) if names else None
        value = self._random.choice([0.5, 3.0, 6, 'fast', 'Dora'])
        if name is None or node.ros._descriptors[name].read_only:
            return
        (result,) = node.ros.set_parameters([Parameter(name, value=value)])
        if result.successful:
            self._live[node.full_name, name] = repr(value)
            done.append(f'(set {node.full_name} {name} = {value!r})')

    def _forget_live(self, plan):
        for operation in plan.operations:
            node, section, name = operation.target
            if section == 'nodes' and operation.action is not Action.CHANGE:
                self._live = {key: each for key, each in self._live.items() if key[0] != node}
            elif operation.action is not Action.CHANGE:
                self._live.pop((node, name), None)

    def _check_refused(self, done, text):
        operations = self._plan.operations if self._plan else ()
        begun_again = [
            each
            for each in operations
            if each.target[1] in ('nodes', 'processes') and each.action is Action.RECREATE
        ]
        _check_same(self._before, describe(self._system), (done, text))
        self._check_untouched(begun_again, (done, text))

    def _check_untouched(self, operations, done):
        lost = find_lost(self._kept, remember(self._system), operations)
        assert not lost, f'{done} changed also {lost}'
        touched = {each.target for each in operations if each.action is not Action.CHANGE}
        nodes = {target[0] for target in touched if target[1] == 'nodes'}
        changed = {target[:2] for target in touched}
        now = see_graph(self._observer.node)[1]
        for (node, kind, topic), gids in self._gids.items():
            if node not in nodes and (node, kind) not in changed and topic[0] != '_':
                if topic in ('/parameter_events', '/rosout') or '/_action/' in topic:
                    continue
                assert now.get((node, kind, topic)) == gids, (done, node, kind, topic)

    def _check_equal(self, fresh, fresh_graph, done):
        for (full_name, name), value in self._live.items():
            fresh['nodes'][full_name]['parameters'][name]['value'] = value
        _check_same(fresh, describe(self._system), done)
        deadline = monotonic() + 10.0
        while (seen := see_graph(self._observer.node)[0]) != fresh_graph:
            if monotonic() > deadline:
                _check_same(fresh_graph, seen, done)
            sleep(0.01)

    def _check_runs(self, plan, done):
        """Wait until all has run that should, on the code that it should."""
        pending = {}
        for full_name, node in self._system._nodes.items():
            for section, entities in node.entities.items():
                for name, entity in entities.items():
                    view = self._find_view(node, section, name)
                    if view is not None and self._should_run(node, section, name, entity):
                        key = full_name, section, name
                        view.own_state.pop('ran', None)
                        pending[key] = view, entity, node
        deadline = monotonic() + DEADLINE_SEC
        touched = {each.target for each in plan.operations}
        while pending:
            for key, (view, entity, node) in list(pending.items()):
                ran = view.own_state.get('ran')
                if ran is not None:
                    _check_ran(ran, describe_bound(entity), (done, key))
                    del pending[key]
                elif key[1] == 'subscriptions':
                    ros = ros_of(entity)
                    self._observer.publish(ros.topic_name, node.spec.subscriptions[key[2]].type)
                elif key[1] == 'services':
                    spec = node.spec.services[key[2]]
                    name = node.ros.resolve_service_name(spec.service)
                    self._observer.wait(self._observer.begin_call(name, spec.type))
                elif key[1] == 'actions':
                    if key not in touched:
                        del pending[key]
                        continue
                    spec = node.spec.actions[key[2]]
                    name = node.resolve_action_name(spec.action)
                    self._observer.wait(self._observer.send_goal(name, spec.type, order=1))
            assert monotonic() < deadline, f'{done}: does not run: {list(pending)}'
            sleep(0.002)

    def _find_view(self, node, section, name):
        for owner, view in node._views.items():
            if f'{owner.kind}s' == section and owner.name == name:
                return view
        return None

    def _should_run(self, node, section, name, entity):
        spec = getattr(node.spec, section)[name]
        if node.full_name == _WITNESS or spec.behaviour is None or not node.gate.is_open:
            return False
        if section == 'timers':
            is_simulated = node.ros.get_parameter('use_sim_time').value and spec.clock == 'ros'
            is_prompt = entity.ros.timer_period_ns < _PROMPT_NS
            return is_prompt and not is_simulated and not entity.ros.is_canceled()
        if section == 'subscriptions':
            return spec.type == 'std_msgs/msg/String'
        if section == 'services':
            return spec.type == 'std_srvs/srv/Trigger'
        return spec.type == 'test_msgs/action/Fibonacci'


def _check_ran(ran, bound, told):
    (described,) = [each for each in bound if 'note' in each['code'][2] or 'own_state' in
                    each['code'][2]] or bound[:1]
    names = described['globals']
    word = names['WORD'] if 'WORD' in names else names['helper'][1]['WORD']
    tags = [names['TAG'], word]
    if 'inner' in names:
        tags.append(names['inner'][1]['TAG'])
    found = [repr(each) for each in ran[1 : 1 + len(tags)]]
    assert found == tags, (told, ran, tags)
    assert described['arguments'].items() <= ran[4].items(), (told, ran, described['arguments'])


def _check_same(expected, found, done):
    different = _differences(expected, found)
    if different:
        pytest.fail(f'after {done}:\n' + '\n'.join(map(str, different)))


def _differences(expected, found, path=()):
    """Yield what differs, with the path to it."""
    if not isinstance(expected, dict) or not isinstance(found, dict):
        return [] if expected == found else [(path, expected, found)]
    return [
        difference
        for key in {**expected, **found}
        for difference in _differences(expected.get(key), found.get(key), (*path, key))
    ]


class Witness:
    """A node that no edit names: what it has begun passes through all of them."""

    def __init__(self, system, observer):
        self._node, self._observer = system._nodes[_WITNESS], observer
        self._ros = self._node.ros
        self._ros.set_parameters([Parameter('level', value=7)])
        observer.publish('/held', 'std_msgs/msg/Int64', data=-1)
        wait_for(lambda: observer.count_subscriptions('/held', 'std_msgs/msg/Int64'), 'a match')
        for number in range(5):
            observer.publish('/held', 'std_msgs/msg/Int64', data=number)
        self._response = observer.begin_call('/slow', 'std_srvs/srv/Trigger')
        self._result = observer.send_goal('/long', 'test_msgs/action/Fibonacci', order=42)

    def release(self):
        """Let what it does come to its end."""
        self._node.behaviour_node.state.released = True

    def check(self):
        """See that nothing was lost."""
        state = self._node.behaviour_node.state
        self.release()
        wait_for(lambda: state.held[-5:] == list(range(5)), 'all messages that were held')
        assert self._observer.wait(self._response).message == 'released'
        assert list(self._observer.wait(self._result).result.sequence) == [42]
        heard = list(state.heard)
        assert heard == list(range(heard[0], heard[0] + len(heard)))
        assert self._node.behaviour_node.parameters.level == 7
        assert self._node.ros is self._ros


@contextmanager
def playing(folder, seed, domains, checked=0.1):
    """Yield a game in a folder.

    Args:
        domains: Two ROS domains; the second is for fresh starts.
        checked: The share of the fresh starts that are checked first.
    """
    project = Project(folder, seed)
    project.write()
    environment = {
        'ROS_DOMAIN_ID': str(domains[0]),
        'AMENT_PREFIX_PATH': f'{folder / "prefix"}:{os.environ.get("AMENT_PREFIX_PATH", "")}',
    }
    with ExitStack() as stack:
        stack.enter_context(mock.patch.dict(os.environ, environment))
        stack.enter_context(mock.patch.object(sys, 'dont_write_bytecode', True))
        modules = {*sys.modules}
        stack.callback(_forget_modules, folder, modules)
        before = os.getcwd()
        os.chdir(folder)
        stack.callback(os.chdir, before)
        fresh = FreshStarter(project.paths, domains[1])
        stack.callback(fresh.close)
        system, reloader = stack.enter_context(running_system(project.paths))
        observer = Observer(domains[0])
        stack.callback(observer.close)
        witness = Witness(system, observer)
        stack.callback(witness.release)
        yield Game(project, seed, system, reloader, fresh, observer, checked)
        witness.check()


def _forget_modules(folder, before):
    for name in {*sys.modules} - before:
        if str(getattr(sys.modules[name], '__file__', '')).startswith(str(folder)):
            del sys.modules[name]
