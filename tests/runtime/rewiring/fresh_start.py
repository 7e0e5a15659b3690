"""Starts systems afresh, each in a process of its own, and tells what they are.

A parent that has imported everything forks for each of them: so a start takes no time for
imports, and nothing of one start is left in the next.
"""

import importlib
import os
import pickle
import struct
import subprocess
import sys
import traceback
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

from tests.running import ROOT

_LENGTH = struct.Struct('!q')
STOP_SEC = 60.0
# What a start waits for is in the same system, unless it is nowhere.
_WAIT_SEC = 5.0
# Their libraries are loaded once.
_MESSAGES = ('builtin_interfaces', 'rcl_interfaces', 'service_msgs', 'std_msgs')
_MESSAGES = (*_MESSAGES, 'std_srvs', 'test_msgs', 'unique_identifier_msgs')


class FreshStarter:
    """Starts the systems of a project afresh, in a ROS domain of their own."""

    def __init__(self, paths, domain_id):
        self._paths = paths
        self._process = subprocess.Popen(
            [sys.executable, '-m', __name__, *map(str, paths)],
            cwd=paths[0].parent,
            env={**os.environ, 'PYTHONPATH': str(ROOT), 'ROS_DOMAIN_ID': str(domain_id)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def begin(self, *, checks):
        """Start the system as its files are now.

        Args:
            checks: Whether it is to be checked first, which takes as long as all the rest.
        """
        self._process.stdin.write(b'c' if checks else b'-')
        self._process.stdin.flush()

    def result(self):
        """Return what it is, or a text that says why it did not start."""
        (length,) = _LENGTH.unpack(self._process.stdout.read(_LENGTH.size))
        return pickle.loads(self._process.stdout.read(length))

    def close(self):
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()


def _read(reader):
    from composer.application.file_selection import load_given
    from composer.checks.checker import create_context
    from composer.interfaces.catalogue import InterfaceCatalogue

    system = load_given(reader.paths, reader.words, reader.set_values, reader=reader.reader)
    return create_context(system, InterfaceCatalogue())


@contextmanager
def running_system(paths, workers=None, *, checks=True):
    """Start a system as `composer up` does; yield it with its reloader.

    Args:
        workers: Run the nodes that are in workers; `None` if all run in this process.

    Raises:
        ComposerError: It has errors, or cannot start.
    """
    from composer.application.reloader import Reloader
    from composer.application.system_reader import SystemReader, import_reading
    from composer.errors import ComposerError
    from composer.planning.snapshot_taking import take_snapshot
    from composer.processes.guardian_client import GuardianClient
    from composer.runtime.behaviours.callables import project_on_path
    from composer.runtime.environment import environment_set
    from composer.runtime.logs import log_levels
    from composer.runtime.system import System
    from tests.runtime.rewiring.inspections import create_parameter_services

    reader = SystemReader(paths, [], [])
    context = reader.check() if checks else _read(reader)
    if context is None:
        message = 'it has errors'
        raise ComposerError(message)
    with ExitStack() as stack:
        stack.enter_context(environment_set(context.spec.environment))
        stack.enter_context(project_on_path([paths[0].parent]))
        snapshot = take_snapshot(context)
        if workers is None:
            snapshot = _with_levels(snapshot)
            reading = import_reading(context, snapshot)
        else:
            stack.callback(workers.kill_all)
            workers.spawn(snapshot.spec)
            with workers.importing():
                reading = import_reading(context, snapshot, workers=workers)
        if reading is None:
            message = 'its behaviours have errors'
            raise ComposerError(message)
        stack.enter_context(log_levels(list(reading.spec.nodes.values()), []))
        guardian = GuardianClient(STOP_SEC, STOP_SEC, owns_process=False)
        stack.callback(guardian.send_away)
        system = System(reading, guardian, workers=workers)
        guardian.wait_until_begun()
        stack.callback(system.stop)
        system.start()
        create_parameter_services(system)
        yield system, Reloader(reader, context, [])


def _with_levels(snapshot):
    """Return a system whose nodes have the levels that their workers give them."""
    nodes = {
        key: replace(node, log_level=snapshot.spec.workers[node.worker].log_level)
        if node.worker and not node.log_level
        else node
        for key, node in snapshot.spec.nodes.items()
    }
    return replace(snapshot, spec=replace(snapshot.spec, nodes=nodes))


def _start_and_tell(paths, answers, *, checks):
    from composer.errors import ComposerError
    from composer.runtime import forked_children
    from tests.runtime.rewiring.descriptions import describe, expect_workers, merge
    from tests.runtime.rewiring.observing import see_graph

    # It is no child of a behaviour, which must end with it.
    forked_children.in_child = False
    try:
        with running_system(paths, checks=checks) as (system, _):
            node = next(iter(system._nodes.values())).ros
            told = merge(describe(system), [])
            told['workers'] = expect_workers(system._reading.spec, told['threads'])
            _send(answers, (told, see_graph(node)[0]))
    except ComposerError as error:
        _send(answers, str(error))
    except BaseException:  # noqa: BLE001 - the parent waits for an answer
        _send(answers, traceback.format_exc())


def _send(answers, answer):
    data = pickle.dumps(answer)
    answers.write(_LENGTH.pack(len(data)) + data)
    answers.flush()


def _serve(paths):
    # What the systems print is no answer.
    answers = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)
    sys.dont_write_bytecode = True
    _import_all(paths)
    while command := os.read(0, 1):
        child = os.fork()
        if child == 0:
            _start_and_tell(paths, answers, checks=command == b'c')
            os._exit(0)
        os.waitpid(child, 0)


def _import_all(paths):
    from composer.application.system_reader import SystemReader

    for name in (
        *('composer.application.reloader', 'composer.runtime.run', 'composer.runtime.system'),
        *('std_msgs.msg', 'std_srvs.srv', 'test_msgs.action', 'diagnostic_msgs.msg'),
        *('tests.runtime.rewiring.inspections', 'tests.runtime.rewiring.observing'),
        *(f'{each}.{each}_s__rosidl_typesupport_c' for each in _MESSAGES),
    ):
        importlib.import_module(name)
    importlib.import_module(
        'composer.language.parsing.condition_parser'
    ).DEFAULT_WAIT_SEC = _WAIT_SEC
    # What the check imports when it needs it.
    SystemReader(paths, [], []).check()


if __name__ == '__main__':
    _serve([Path(argument) for argument in sys.argv[1:]])
