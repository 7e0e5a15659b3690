"""A game: random edits of a running system, after each of which all of it is compared."""

import os
import random
import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic, sleep
from unittest import mock

import pytest

from composer.planning.differences import compare
from composer.planning.plan import Action
from composer.processes import worker_supervisor
from composer.runtime import system as system_module
from composer.runtime.workers.workers import Workers
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.descriptions import describe_worker, merge
from tests.runtime.rewiring.edits import Project
from tests.runtime.rewiring.fresh_start import FreshStarter, running_system
from tests.runtime.rewiring.inspections import FAULT, Inspection, InspectionElsewhere
from tests.runtime.rewiring.observing import Observer, see_graph
from tests.runtime.rewiring.witness import WITNESS, Witness

# What only a system that runs can have against an edit.
_OWN_REASONS = (
    'cannot change while the system runs',
    'its value was set while the system ran',
    ': no',  # What `decide` returns.
    # A fresh start of the game has no workers.
    'cannot have cpus',
)
_WORKER = Path(__file__).with_name('inspected_worker.py')
# Topics of every node.
_OF_NODES = ('/parameter_events', '/rosout')


class Game:
    """A running system, its files, and all that it is compared with.

    Attributes:
        applied: How many edits have changed the system.
    """

    def __init__(self, project, seed, system, reloader, fresh, observer, checked):
        self._project = project
        self._random = random.Random(seed)
        self._system = system
        self._own = Inspection(system)
        self._reloader = reloader
        self._fresh = fresh
        self._observer = observer
        self._checked = checked
        # What was set while the system ran, by its node and parameter.
        self._live = {(WITNESS, 'level'): '7'}
        self._plan = None
        self.applied = 0
        project.keep()
        # What is in workers comes to both later.
        inside = system._nodes[WITNESS].ros
        wait_for(lambda: see_graph(inside)[0] == see_graph(self._observer.node)[0], 'the graph')

    def play(self, done=None):
        """Edit, reload, and compare; return the edits, and what came of them."""
        done = self._project.edit() if done is None else done
        self._project.write()
        self._set_live(done)
        self._before = self._describe()
        for each in self._processes():
            each.remember()
        self._graph, self._gids = see_graph(self._observer.node)
        self._old = self._system.snapshot
        self._plan = None
        with self._failing(done):
            outcome, text = self._reload(done)
        if FAULT in text:
            self._check_refused(done, text)
            outcome, text = self._reload(done)
        if not outcome.succeeded:
            if self._plan is not None and not any(each in text for each in _OWN_REASONS):
                self._fresh.begin(checks=True)
                assert isinstance(self._fresh.result(), str), f'{done}: only refused: {text}'
            self._check_refused(done, text)
            self._project.go_back()
            return done, text
        plan = compare(self._old, self._system.snapshot)
        if not plan and self._random.random() > self._checked:
            # It was compared before, and must be the same now, but for the lines of the files.
            self._check_graph(self._graph, done)
            self._check_untouched((), done)
            self._project.keep()
            return done, text
        # It has passed the check in this process, as it does in any other.
        self._fresh.begin(checks=self._random.random() < self._checked)
        try:
            self._forget_live(plan)
            self._check_untouched(plan.operations, done)
        finally:
            fresh = self._fresh.result()
        if isinstance(fresh, str):
            # It counts from the next start: this system would not survive one.
            assert 'on_start raised' in fresh or 'waited' in fresh or 'wait' in fresh, (
                done,
                fresh,
            )
            self._project.go_back()
            self._project.write()
            assert self._reloader.reload(self._system).succeeded, done
            return done, f'would not start: {fresh}'
        self._check_equal(*fresh, done)
        self.applied += bool(plan)
        self._project.keep()
        return done, text

    def _reload(self, done):
        outcome = self._reloader.reload(self._system)
        assert not self._system.stop_requested, done
        for each in self._processes():
            each.create_parameter_services()
        return outcome, outcome.text.splitlines()[-1]

    def _processes(self):
        """Return what looks into each process, that of the system first."""
        return [self._own, *map(InspectionElsewhere, self._system.workers._list())]

    def _describe(self):
        own, *others = self._processes()
        parts = [each.describe() for each in others]
        workers = {
            each.worker.name: describe_worker(each.worker, part)
            for each, part in zip(others, parts, strict=True)
        }
        return {**merge(own.describe(), parts), 'workers': workers}

    @contextmanager
    def _failing(self, done):
        """Let one step of the reload fail now and then, after it was done; and see the plan."""
        number = self._random.choice([0] * 20 + [1, 2, 3, 4, 5])
        process = self._random.choice(self._processes())

        def seeing(old, new):
            plan = compare(old, new)
            # That of the whole is made first.
            self._plan = self._plan or plan
            return plan

        if number:
            done.append(f'(fails at step {number})')
            process.fail_at(number)
        with mock.patch.object(system_module, 'compare', seeing):
            yield
        # A worker that has ended meanwhile cannot be told.
        workers = [getattr(each, 'worker', None) for each in self._processes()]
        if number and getattr(process, 'worker', None) in workers:
            process.fail_at(0)

    def _set_live(self, done):
        """Set a parameter or a value of the state now and then."""
        if self._random.random() < 0.7:
            return
        process = self._random.choice(self._processes())
        found = process.set_live(self._random.random(), f'live {self.applied}')
        if found is not None:
            *key, value = found
            self._live[tuple(key)] = value
            done.append(f'(set {key} = {value})')

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
        _check_same(self._before, self._describe(), (done, text))
        self._check_graph(self._graph, (done, text))
        self._check_untouched(begun_again, (done, text))

    def _check_untouched(self, operations, done):
        lost = [lost for each in self._processes() for lost in each.find_lost(operations)]
        assert not lost, f'{done} changed also {lost}'
        touched = {each.target for each in operations if each.action is not Action.CHANGE}
        nodes = {target[0] for target in touched if target[1] == 'nodes'}
        # Their subscriptions to `/clock` come and go, also where the edit is taken back.
        timed = {
            each.target[0]
            for each in (self._plan.operations if self._plan else ())
            if 'use_sim_time' in {change.key for change in each.changes}
        }
        changed = {target[:2] for target in touched}
        now = see_graph(self._observer.node)[1]
        for (node, kind, topic), gids in self._gids.items():
            if node not in nodes and (node, kind) not in changed and topic[0] != '_':
                if topic == '/clock' and node in timed:
                    continue
                if topic in _OF_NODES or '/_action/' in topic or '/_service_event' in topic:
                    continue
                assert now.get((node, kind, topic)) == gids, (done, node, kind, topic)

    def _check_equal(self, fresh, fresh_graph, done):
        for (full_name, name), value in self._live.items():
            fresh['nodes'][full_name]['parameters'][name]['value'] = value
        _check_same(fresh, self._describe(), done)
        self._check_graph(fresh_graph, done)

    def _check_graph(self, expected, done):
        """Wait until the observer sees what it should: what others do comes to it later."""
        deadline = monotonic() + DEADLINE_SEC
        while (seen := see_graph(self._observer.node)[0]) != expected:
            if monotonic() > deadline:
                _check_same(expected, seen, done)
            sleep(0.01)


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


@contextmanager
def playing(folder, seed, domains, checked=0.1):
    """Yield a game in a folder.

    Args:
        domains: Two ROS domains; the second is for fresh starts.
        checked: The share of the fresh starts that are checked first, and of the edits of which the
            plan says that they change nothing for which there is a fresh start.
    """
    project = Project(folder, seed)
    project.write()
    environment = {
        'ROS_DOMAIN_ID': str(domains[0]),
        'PYTHONDONTWRITEBYTECODE': '1',
        'AMENT_PREFIX_PATH': f'{folder / "prefix"}:{os.environ.get("AMENT_PREFIX_PATH", "")}',
    }
    with ExitStack() as stack:
        stack.enter_context(mock.patch.dict(os.environ, environment))
        stack.enter_context(mock.patch.object(sys, 'dont_write_bytecode', True))
        modules = {*sys.modules}
        stack.callback(_forget_modules, folder, modules)
        before = Path.cwd()
        os.chdir(folder)
        stack.callback(os.chdir, before)
        fresh = FreshStarter(project.paths, domains[1])
        stack.callback(fresh.close)
        stack.enter_context(mock.patch.object(worker_supervisor, '_PROGRAM', _WORKER))
        system, reloader = stack.enter_context(running_system(project.paths, Workers()))
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
