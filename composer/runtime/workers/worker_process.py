"""The process of a worker: what it does when the process of the system asks."""

from __future__ import annotations

import errno
import faulthandler
import gc
import io
import os
import signal
import sys
import threading
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, ExitCode, StartError
from composer.executor.after_fork import flush_output
from composer.processes.channel import Channel
from composer.processes.guardian import tell
from composer.processes.guardian_client import print_stacks_at_signal
from composer.processes.reaper import LINK
from composer.runtime import forked_children
from composer.runtime.behaviours.callables import (
    BehaviourImportError,
    import_behaviour,
    shape_of,
)
from composer.runtime.logs import log_levels
from composer.runtime.rewiring.fresh_modules import fresh_modules
from composer.runtime.tracing.tracer import tracer
from composer.runtime.workers.worker_system import WorkerSystem

if TYPE_CHECKING:
    import inspect
    from collections.abc import Callable, Collection, Mapping, Sequence
    from types import FrameType

    from composer.language.specs import WorkerSpec
    from composer.planning.snapshot import Snapshot
    from composer.runtime.behaviours.callables import Shape
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.health.system_state import Outcome
    from composer.runtime.rewiring.edit import Edit
    from composer.runtime.tracing.tracer import TracePart
    from composer.runtime.workers.assignment import Assignment, ImportRequest

# Added to the number of a signal, as shells do.
_BY_SIGNAL = 128
_LONGEST_EXIT_SEC = 10.0
_POLL_SEC = 0.5
# Those of the system.
_cpus_before = os.sched_getaffinity(0)
_nice_before = os.getpriority(os.PRIO_PROCESS, 0)


def main(name: str) -> None:
    """Run the worker of this name until the process of the system ends it."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Whole lines, also if Python was told not to buffer: others write there, too.
            stream.reconfigure(line_buffering=True, write_through=False, errors='backslashreplace')
    print_stacks_at_signal()
    worker = WorkerProcess(name)
    # What a user or the kernel sends to this process alone: its nodes stop, and that is a failure.
    for number in (signal.SIGTERM, signal.SIGINT):
        forked_children.signal_handlers[number] = signal.getsignal(number)
        signal.signal(number, worker.terminate)
    worker.run()


class WorkerProcess:
    """Runs the nodes of a worker; its public methods are what the system's process calls."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._system: WorkerSystem | None = None
        self._functions: Mapping[str, Callable[..., Any]] = {}
        self._fresh = ExitStack()
        self._levels = ExitStack()
        self._edit: Edit | None = None
        self._code = ExitCode.DONE
        self._ended = threading.Event()
        self._stopping = threading.Lock()
        self._stopped: tuple[int, bool] | None = None
        calls = (
            *(self.import_behaviours, self.keep_imports, self.drop_imports),
            *(self.create, self.run_on_start),
            *(self.open, self.start_waiting, self.be_up, self.stop, self.end),
            *(self.ping, self.status, self.top, self.restart_node, self.find_hidden),
            *(self.lose_servers, self.fail_request, self.begin_trace, self.end_trace),
            *(self.begin_edit, self.wait_for_goals, self.make_way, self.apply_edit),
            *(self.commit_edit, self.undo_edit, self.follow),
        )
        functions = {each.__name__: each for each in calls}
        self._channel = Channel(LINK, 'the process of the system', functions, self._on_lost)
        self._channel.listen()

    def run(self) -> None:
        """Wait for the end, and exit with its code."""
        # Python handles a signal when this thread runs, and another one may have been interrupted.
        while not self._ended.wait(_POLL_SEC):
            pass
        flush_output()
        # Threads and `atexit` functions of behaviours must not keep the process alive.
        with suppress(RuntimeError, ValueError):
            faulthandler.dump_traceback_later(_LONGEST_EXIT_SEC, exit=True)
        if self._system is None or self._system.has_ended:
            sys.exit(self._code)
        os._exit(self._code)

    def terminate(self, number: int, _frame: FrameType | None) -> None:
        """Handle a signal that asks for the end."""
        signal.signal(number, signal.SIG_DFL)
        code = _BY_SIGNAL + number
        threading.Thread(target=self._end_by_itself, args=(code,), daemon=True).start()

    def _end_by_itself(self, code: int) -> None:
        system = self._system
        if system is not None:
            self._stop_nodes(system)
        if system is None or not system.is_told_to_stop:
            self._code = code  # type: ignore[assignment]
            self._ended.set()

    def _stop_nodes(self, system: WorkerSystem) -> tuple[int, bool]:
        """Stop the nodes, once, though a signal and the system may ask for it at a time."""
        with self._stopping:
            if self._stopped is None:
                self._stopped = system.stop()
            return self._stopped

    def _on_lost(self) -> None:
        # Nothing of a system outlives its process.
        if not self._channel.is_intact:
            tell(
                f"[FATAL] [composer]: worker '{self._name}' has lost its connection to the system:"
                ' a behaviour may have closed descriptors that are not its own'
            )
        os._exit(ExitCode.FAILED)

    def import_behaviours(self, request: ImportRequest) -> list[Shape | tuple[str, str | None]]:
        """Import behaviours; return the shape of each, or its error and the help."""
        sys.path[:] = [*request.search_path, *request.path]
        import_rest = self._fresh.enter_context(fresh_modules(request.stale, request.sources))
        shapes: list[Shape | tuple[str, str | None]] = []
        functions: dict[str, Callable[..., Any]] = {}
        for spec in request.behaviours:
            try:
                functions[spec.name] = function = import_behaviour(spec)
            except BehaviourImportError as error:
                shapes.append((str(error), error.help))
            else:
                kind, signature = shape_of(function)
                shapes.append((kind, _portable(signature)))
        import_rest()
        self._functions = functions
        return shapes

    def keep_imports(self) -> None:
        """Keep what was imported last."""
        self._fresh.pop_all().close()

    def drop_imports(self) -> None:
        """Have the modules back that were there before the last imports."""
        with suppress(_UnwantedError), self._fresh.pop_all():
            raise _UnwantedError

    def create(
        self, assignment: Assignment, clients: frozenset[bytes]
    ) -> tuple[int, frozenset[bytes]]:
        """Create the nodes.

        Args:
            clients: See `LocalPart.create`.

        Returns:
            What marks the processes that their behaviours start, and its participants of DDS.

        Raises:
            StartError: One of them cannot be created.
        """
        limit_processor(assignment.worker)
        spec = assignment.snapshot.spec
        self._levels.enter_context(log_levels(list(spec.nodes.values()), assignment.log_levels))
        self._system = WorkerSystem(assignment, self._functions, self._channel)
        threading.Thread(target=self._wait, name='worker', daemon=True).start()
        self._system.create(clients)
        return self._system.mark, self._system.find_participants()

    def _wait(self) -> None:
        system = self._running
        system.wait()
        if not system.is_told_to_stop:
            # It fails by itself, as where a behaviour has shut down the ROS context.
            self._end_by_itself(ExitCode.FAILED)

    @property
    def _running(self) -> WorkerSystem:
        if self._system is None:
            message = f"worker '{self._name}' has no nodes yet"
            raise ComposerError(message)
        return self._system

    def run_on_start(self) -> bool:
        """Run `on_start` of the nodes that wait for nothing; return whether others wait."""
        return self._running.run_on_start()

    def open(self) -> None:
        """Let the behaviours of these be called."""
        self._running.open()

    def start_waiting(self) -> None:
        """Start the nodes that wait for something."""
        self._running.start_waiting()

    def be_up(self) -> None:
        """Run from now on: all of the system has started."""
        self._running.be_up()
        gc.freeze()
        gc.enable()

    def stop(self) -> tuple[int, bool]:
        """Stop the nodes; return the exit code, and whether all behaviours have ended."""
        system = self._system
        if system is None:
            return ExitCode.DONE, True
        system.is_told_to_stop = True
        system.request_stop()
        return self._stop_nodes(system)

    def end(self) -> None:
        """Exit, as the answer of `stop` has come to the system's process."""
        self._ended.set()

    def ping(self) -> None:
        """Answer, as long as threads of Python run here."""

    def status(self) -> dict[str, Any]:
        """Return what this process says of itself."""
        return self._running.describe_status()

    def top(self) -> dict[str, Any] | None:
        """Return the health of the entities."""
        return self._running.describe_top()

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node anew."""
        return self._running.restart_node(full_name)

    def find_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes that have not started."""
        return self._running.list_hidden()

    def lose_servers(self, participants: frozenset[bytes]) -> None:
        """End what waits for servers that were killed; see `LocalPart.lose_servers`."""
        self._running.lose_servers(participants)

    def fail_request(self, failure: RequestFailure) -> None:
        """End the call that waits for the response to a request."""
        self._running.take_failure(failure)

    def begin_trace(self) -> None:
        """Note what happens from now on; there may be no nodes yet."""
        if self._system is None:
            tracer.turn_on()
        else:
            self._system.begin_trace()

    def end_trace(self) -> TracePart:
        """Return what was noted."""
        return self._running.end_trace()

    def begin_edit(self, snapshot: Snapshot) -> None:
        """Begin an edit; all that was imported last is part of it."""
        self._edit = self._running.begin_edit(self._running.read(snapshot, self._functions))

    def wait_for_goals(self) -> None:
        """Wait until no goal is in flight of an action that goes."""
        channel = self._channel

        def ask(name: str) -> Callable[[], bool]:
            return lambda: bool(channel.call(name))

        self._current_edit.wait_for_goals(ask('aborts_goals'), ask('is_outdated'))

    def make_way(self, names: Collection[str]) -> None:
        """End nodes that begin elsewhere."""
        self._current_edit.make_way(names)

    def apply_edit(self) -> None:
        """Do all that the edit says."""
        self._current_edit.apply(lambda: bool(self._channel.call('is_outdated')))

    def commit_edit(self) -> None:
        """Let go of what was there before."""
        self._current_edit.commit()
        self._edit = None

    def undo_edit(self) -> None:
        """Be as before."""
        if self._edit is not None:
            self._edit.undo()
            self._edit = None

    @property
    def _current_edit(self) -> Edit:
        if self._edit is None:
            message = 'there is no edit'
            raise ComposerError(message)
        return self._edit

    def follow(self, spec: WorkerSpec) -> None:
        """Use the processor, and as many threads, as a worker says from now on."""
        limit_processor(spec)
        self._running.limit_threads(spec)


class _UnwantedError(Exception):
    """What was imported is not wanted."""


def limit_processor(spec: WorkerSpec) -> None:
    """Let this process use the cores, and have the niceness, that a worker says.

    Raises:
        StartError: This machine has no such cores, or the niceness needs privileges.
    """
    # Linux itself leaves out cores that there are not, as long as there is one.
    if not _cpus_before.issuperset(spec.cpus):
        raise _no_such_cores(spec)
    try:
        # Linux has both for each thread; new ones have those of the thread that starts them.
        for thread in map(int, os.listdir('/proc/self/task')):  # noqa: PTH208 - numbers
            with suppress(ProcessLookupError):
                if spec.cpus or os.sched_getaffinity(thread) != _cpus_before:
                    os.sched_setaffinity(thread, spec.cpus or _cpus_before)
                os.setpriority(os.PRIO_PROCESS, thread, _nice_before + (spec.nice or 0))
    except OSError as error:
        if error.errno == errno.EINVAL:
            raise _no_such_cores(spec) from error
        message = f"worker '{spec.name}' cannot have nice {spec.nice}: {error.strerror}"
        raise StartError(message) from error


def _no_such_cores(spec: WorkerSpec) -> StartError:
    message = f"worker '{spec.name}' cannot have cpus {list(spec.cpus)}"
    return StartError(message, help=f'the cores that there are for it: {sorted(_cpus_before)}')


def _portable(signature: inspect.Signature | None) -> inspect.Signature | None:
    """Return a signature whose defaults and annotations another process needs not have."""
    if signature is None:
        return None
    parameters: Sequence[inspect.Parameter] = [
        each.replace(
            annotation=each.empty, default=each.empty if each.default is each.empty else ...
        )
        for each in signature.parameters.values()
    ]
    return signature.replace(parameters=parameters, return_annotation=signature.empty)
