"""After any edits, a running system equals a fresh start of its files; all else was untouched.

`python -m tests.runtime.rewiring.test_random_edits SEED COUNT` plays on, and prints each edit.
"""

import os
import sys
import threading
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.cli.common.system_reader import SystemReader, import_reading
from composer.cli.reload import Reloader
from composer.entity_kinds import ENTITY_KINDS
from composer.planning.differences import compare
from composer.planning.plan import Action
from composer.planning.snapshot import take_snapshot
from composer.processes.guardian_client import GuardianClient
from composer.runtime.behaviours.callables import project_on_path
from composer.runtime.system import System
from tests.runtime.rewiring.edits import Project

pytestmark = pytest.mark.ros

STOP_SEC = 60.0


def start(project, guardian):
    reader = SystemReader([project.path], [], [])
    context = reader.check()
    reading = import_reading(context, take_snapshot(context))
    system = System(reading, guardian)
    system.start()
    # These services come in the background.
    system._parameter_services.stop()
    for node in system._nodes.values():
        node.ros.start_parameter_services()
    return system, Reloader(reader, context, [])


def describe(system):
    """Return all that a system is, as it can be seen from outside, or called."""
    nodes = {name: describe_node(node) for name, node in sorted(system._nodes.items())}
    processes = {
        name: (process.spec.command, dict(process.spec.env), process.spec.required, process.state)
        for name, process in sorted(system._processes.by_name.items())
    }
    return {'nodes': nodes, 'processes': processes}


def describe_node(node):
    ros = node.ros
    if ros._late_events is not None:
        ros._late_events.create()  # It comes with the first event.
    subscriptions = [
        (each.topic_name, each.msg_type, describe_qos(each.qos_profile), describe_group(each))
        for each in ros.subscriptions
    ]
    publishers = [
        (each.topic_name, each.msg_type, describe_qos(each.qos_profile)) for each in ros.publishers
    ]
    services = [(each.srv_name, each.srv_type, describe_group(each)) for each in ros.services]
    clients = [(each.srv_name, each.srv_type) for each in ros.clients]
    timers = [
        (each.timer_period_ns, each.clock.clock_type, each.is_canceled(), describe_group(each))
        for each in ros.timers
    ]
    parameters = {
        name: (ros.get_parameter(name).type_, node.behaviour_node.parameters[name])
        for name in node.spec.parameters
    }
    descriptors = {name: str(ros.describe_parameter(name)) for name in node.spec.parameters}
    return {
        'entities': {
            kind.section: sorted(node.entities[kind.section])
            for kind in ENTITY_KINDS
            if node.entities.get(kind.section)
        },
        'subscriptions': sorted(subscriptions, key=str),
        'publishers': sorted(publishers, key=str),
        'services': sorted(services, key=str),
        'clients': sorted(clients, key=str),
        'timers': sorted(timers, key=str),
        'waitables': len(list(ros.waitables)),
        'guards': len(list(ros.guards)),
        'parameters': parameters,
        'descriptors': descriptors,
        'sim_time': ros.get_parameter('use_sim_time').value,
        'gate': (node.gate.is_open, node.gate.serves, node.gate.is_paused),
        'endpoints': len(node.endpoints),
        'suspended': len(node.suspended),
        'limits': {
            str(owner): limit.after_sec
            for owner, limit in node.limits.items()
            if owner.kind not in ('on_start', 'on_stop')  # They count from the next start.
        },
        'bound': {
            str(owner): describe_bound(entity)
            for owner, entity in sorted(node.entities['timers'].items())
        },
        'state': sorted(vars(node.behaviour_node.state)),
    }


def check_equal(expected, found, done):
    different = differences(expected, found)
    if different:
        pytest.fail(f'after {done}: {different}')


def differences(expected, found, path=()):
    """Return what differs, with the path to it."""
    if not isinstance(expected, dict) or not isinstance(found, dict):
        return [] if expected == found else [(path, expected, found)]
    return [
        difference
        for key in {**expected, **found}
        for difference in differences(expected.get(key), found.get(key), (*path, key))
    ]


def describe_bound(timer):
    begin = getattr(timer._ticker, '_begin', None)
    return None if begin is None else (begin.func.__code__.co_code, begin.keywords)


def describe_qos(profile):
    return tuple(getattr(profile, name) for name in sorted(profile.get_c_qos_profile().to_dict()))


def describe_group(entity):
    return type(entity.callback_group).__name__


class Game:
    def __init__(self, project, domains, guardian):
        self._project = project
        self._domains = domains
        self._guardian = guardian
        os.environ['ROS_DOMAIN_ID'] = str(domains[0])
        self.system, self._reloader = start(project, guardian)
        self.applied = 0
        project.keep()

    def play(self):
        """Edit, reload, and compare; return the edits, and the plan."""
        done = self._project.edit()
        before = describe(self.system)
        kept = identities(self.system)
        old = self.system.snapshot
        outcome = self._reloader.reload(self.system)
        plan = compare(old, self.system.snapshot)
        if not outcome.succeeded:
            assert not plan
            check_equal(before, describe(self.system), done)
            self._project.go_back()
            return done, None
        self.applied += bool(plan)
        self._project.keep()
        fresh = self._start_fresh()
        check_equal(fresh, describe(self.system), done)
        named = {each.target for each in plan.operations if each.action is not Action.CHANGE}
        now = identities(self.system)
        untouched = {key for key in kept if not is_named(key, named)}
        assert {key: now.get(key) for key in untouched} == {key: kept[key] for key in untouched}
        return done, plan

    def _start_fresh(self):
        os.environ['ROS_DOMAIN_ID'] = str(self._domains[1])
        try:
            system, _ = start(self._project, self._guardian)
            described = describe(system)
            system.request_stop()
            system._stop()
        finally:
            os.environ['ROS_DOMAIN_ID'] = str(self._domains[0])
        return described


def identities(system):
    """Return the objects of rclpy that nodes and entities have, by their targets."""
    found = {}
    for full_name, node in system._nodes.items():
        found[full_name, 'nodes', ''] = node.ros
        for section, entities in node.entities.items():
            for name, entity in entities.items():
                found[full_name, section, name] = entity
    for name, process in system._processes.by_name.items():
        found['', 'processes', name] = process.run and process.run.number
    return found


def is_named(target, named):
    return target in named or (target[0], 'nodes', '') in named


@contextmanager
def game(folder, seed, domains):
    project = Project(folder, seed)
    with ExitStack() as stack:
        before = Path.cwd()
        os.chdir(folder)
        stack.callback(os.chdir, before)
        guardian = GuardianClient(STOP_SEC, STOP_SEC, owns_process=False)
        stack.callback(guardian.send_away)
        stack.enter_context(project_on_path([folder]))
        playing = Game(project, domains, guardian)
        stack.callback(playing.system.stop)
        yield playing


def test_edits(tmp_path, domain_id, other_domain_id):
    with game(tmp_path, 1, (domain_id, other_domain_id)) as playing:
        for _ in range(100):
            playing.play()
    assert playing.applied > 30


if __name__ == '__main__':
    import tempfile

    seed, count = map(int, sys.argv[1:])
    with (
        tempfile.TemporaryDirectory() as folder,
        game(
            Path(folder),
            seed,
            (int(os.environ['ROS_DOMAIN_ID']), int(os.environ['ROS_DOMAIN_ID']) + 1),
        ) as playing,
    ):
        for number in range(count):
            done, plan = playing.play()
            print(number, done, 'refused' if plan is None else len(plan.operations), flush=True)
        print('applied', playing.applied)
    print(threading.enumerate())
    os._exit(0)
