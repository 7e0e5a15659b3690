"""The workers of a system, as the process of the system sees them.

Nothing of ROS is imported here: workers are started before this process imports ROS, so that all
import it at the same time.
"""

from __future__ import annotations

import queue
import sys
import threading
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, cast

from composer.errors import ComposerError, ExitCode, StartError
from composer.language.bindings import system_bindings
from composer.processes.worker_supervisor import WorkerSupervisor
from composer.runtime.workers.assignment import Assignment, ImportRequest
from composer.runtime.workers.losses import describe_losses
from composer.runtime.workers.worker import Worker
from composer.runtime.workers.worker_edits import ChangedWorker, ReplacedWorker
from composer.runtime.workers.worker_watch import WorkerWatch

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from composer.language.bindings import Binding
    from composer.language.specs import ProcessState, SystemSpec, WorkerSpec
    from composer.planning.snapshot import Snapshot
    from composer.processes.external_process import ExternalProcess
    from composer.runtime.elsewhere import AwaitedProcess
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.workers.worker_edits import WorkerEdit
    from composer.terminal import EscapingLogger

# How long a worker may take to answer what is only asked.
_ANSWER_SEC = 1.0
# How much longer than its behaviours a worker may take to stop.
_MARGIN_SEC = 1.0
_KILL_SEC = 0.5
_EXIT_SEC = 5.0
# How long an edit waits for a worker that is being started again.
_RESTART_SEC = 10.0


class _LazyLogger:
    """The logger of the system, for what is made before ROS is imported."""

    def __getattr__(self, level: str) -> Any:
        from composer.runtime.logs import system_logger

        return getattr(system_logger, level)


class SystemOfWorkers(Protocol):
    """The process of the system, as far as workers ask for it."""

    def request_stop(self, code: int = ExitCode.DONE) -> None:
        """Let the system stop."""

    def ending(self, end: Callable[[], None]) -> AbstractContextManager[bool]:
        """Have `end` called if a stop is requested before the block ends."""

    def find_process(self, name: str) -> AwaitedProcess:
        """Return an external process."""

    def list_hidden(self) -> frozenset[str]:
        """Return the full names of its nodes that have not started."""


class Workers:
    """Starts, asks, edits and stops the workers of a system.

    Args:
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line.

    Attributes:
        are_used: Whether nodes run in workers; else all run in the process of the system.
    """

    def __init__(
        self,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
        *,
        are_used: bool = True,
    ) -> None:
        self.are_used = are_used
        self._ros_arguments = ros_arguments
        self._log_levels = log_levels
        self._workers: dict[str, Worker] = {}
        # Those that an edit brings.
        self._coming: dict[str, Worker] = {}
        self._spec: SystemSpec | None = None
        self._system: SystemOfWorkers | None = None
        self._aborts_goals: Callable[[], bool] = _never
        self._is_outdated: Callable[[], bool] = _never
        self._log = cast('EscapingLogger', _LazyLogger())
        # Held while a worker is started again, or the system edited.
        self._lock = threading.Lock()
        self._restarting: Worker | None = None
        self._stops: queue.SimpleQueue[tuple[int, bool]] = queue.SimpleQueue()
        self._stopping = 0
        self._watch = WorkerWatch(lambda: list(self._workers.values()), self._log)
        self._supervisor = WorkerSupervisor(self._log, self._end_system, _KILL_SEC)
        self._supervisor.on_end = self._tell_losses
        self._supervisor.on_restart = self._begin_again
        self._supervisor.on_exit = self._act_on_end

    @property
    def names(self) -> list[str]:
        """The names of the workers that have nodes."""
        return list(self._workers)

    def own_part(self, reading: Reading) -> Reading:
        """Return what the process of the system runs itself."""
        if not self.are_used:
            return reading
        snapshot = _part(reading.snapshot, '')
        return replace(reading, spec=snapshot.spec, snapshot=snapshot)

    def spawn(self, spec: SystemSpec) -> None:
        """Start the processes of all workers of a system; those that run already go on.

        One that needs another process gets it beside the old one, which goes later.

        Raises:
            StartError: A process cannot be started.
        """
        for name in used_workers(spec) if self.are_used else ():
            worker, before = spec.workers[name], self._workers.get(name)
            if before is None or _needs_new_process(before.spec, worker):
                self._coming[name] = new = Worker(worker, self._supervisor, self._functions(name))
                new.spawn()

    def _functions(self, name: str) -> dict[str, Callable[..., Any]]:
        """Return what a worker may call."""
        return {
            'request_stop': self._end_system,
            'find_hidden': partial(self.find_hidden, name),
            'process_state': self._describe_process,
            'process_has_come_to': self._has_come_to,
            'aborts_goals': self._tell_aborts_goals,
            'is_outdated': self._tell_is_outdated,
        }

    def _tell_aborts_goals(self) -> bool:
        return self._aborts_goals()

    def _tell_is_outdated(self) -> bool:
        return self._is_outdated()

    def _end_system(self, code: int) -> None:
        if self._system is not None:
            self._system.request_stop(code)

    def _describe_process(self, name: str) -> tuple[bool, str]:
        process = self._the_system.find_process(name)
        return process.is_done, process.state

    def _has_come_to(self, name: str, state: ProcessState | None) -> bool:
        return self._the_system.find_process(name).has_come_to(state)

    @property
    def _the_system(self) -> SystemOfWorkers:
        if self._system is None:
            message = 'the system has not begun'
            raise ComposerError(message)
        return self._system

    def import_behaviours(
        self, snapshot: Snapshot, search_path: Iterable[Path], stale: Collection[str] = ()
    ) -> Iterator[tuple[Binding, Any]]:
        """Have each worker import the behaviours of its nodes, beginning now.

        Args:
            stale: The modules to execute anew.

        Returns:
            Each behaviour, and its `Shape`, or the text and the help of an error.
        """
        folders = [str(each) for each in search_path]
        bindings: dict[str, list[Binding]] = {}
        workers = self._next(snapshot.spec)
        for worker in workers:
            part = snapshot.spec.in_worker(worker.name)
            bindings[worker.name] = list(system_bindings(part))
            specs = {each.behaviour.name: each.behaviour for each in bindings[worker.name]}
            worker.next_request = ImportRequest(
                list(specs.values()), sys.path, folders, snapshot.sources, stale
            )
        return (
            (binding, shapes[binding.behaviour.name])
            for worker, shapes in self._each([each for each in workers if each.is_alive], _import)
            for binding in bindings[worker.name]
        )

    def _next(self, spec: SystemSpec) -> list[Worker]:
        """Return the workers of a system, those that come instead of those that are there."""
        both = {**self._workers, **self._coming}
        return [both[name] for name in used_workers(spec)]

    @contextmanager
    def importing(self) -> Iterator[None]:
        """Keep what was imported in the block, and the workers that came; not if it raises.

        No worker is started again meanwhile.
        """
        with self._restarting_none():
            try:
                yield
            except BaseException:
                self._each_call('drop_imports')
                coming, self._coming = list(self._coming.values()), {}
                for worker in coming:
                    worker.remove(_KILL_SEC)
                raise
            self._each_call('keep_imports')
            for worker in {**self._workers, **self._coming}.values():
                worker.request = worker.next_request

    @contextmanager
    def _restarting_none(self) -> Iterator[None]:
        """Wait until no worker is being started again; one that takes long begins anew later."""
        while not self._lock.acquire(timeout=_RESTART_SEC):
            if self._restarting is not None:
                self._supervisor.kill(self._restarting.process)
        try:
            yield
        finally:
            self._lock.release()

    def _each_call(self, name: str) -> None:
        for worker in {**self._workers, **self._coming}.values():
            if worker.is_alive:
                with suppress(ComposerError):
                    worker.call(name)

    def bind(self, system: SystemOfWorkers, reading: Reading) -> None:
        """Be the workers of a system that runs as `reading`, from its start on."""
        self._system = system
        self._workers, self._coming = self._coming, {}
        self._spec = reading.snapshot.spec
        self._supervisor.timeout_sec = self._spec.shutdown_timeout_sec
        for name, worker in self._workers.items():
            worker.assignment = self._assign(reading.snapshot, name)
        if self.are_used:
            self._watch.start()

    def _assign(self, snapshot: Snapshot, name: str) -> Assignment:
        return Assignment(
            snapshot.spec.workers[name],
            _part(snapshot, name),
            self._ros_arguments,
            self._log_levels,
        )

    @contextmanager
    def together(self, step: str) -> Iterator[list[Any]]:
        """Have all workers do a step of their start while the block runs; wait for all.

        Yields:
            What they return, once the block has ended.

        Raises:
            ComposerError: One of them failed; the others may still be at it.
        """
        results: list[Any] = []
        outcomes = self._each(list(self._workers.values()), lambda each: each.do(step))
        yield results
        results += [result for _, result in outcomes]

    def keep_up(self) -> None:
        """Keep all workers up from now on, as the file says.

        Raises:
            StartError: One has ended already.
        """
        for worker in self._workers.values():
            worker.is_up = True
            worker.keep_to_rules()
        for worker in self._workers.values():
            if not worker.is_alive:
                raise StartError(worker.describe_failed_start())

    def be_up(self) -> None:
        """Tell all workers that the system has started."""
        for worker in self._workers.values():
            with suppress(ComposerError):
                worker.channel.tell('be_up')

    def _each(
        self, workers: Sequence[Worker], do: Callable[[Worker], Any]
    ) -> Iterator[tuple[Worker, Any]]:
        """Do something with all workers at the same time; yield each with its result.

        It begins at once. After a request to stop, nothing more is waited for.

        Raises:
            ComposerError: It failed with one of them.
        """
        outcomes: queue.SimpleQueue[tuple[Worker, Any, BaseException | None] | None]
        outcomes = queue.SimpleQueue()

        def run(worker: Worker) -> None:
            try:
                outcomes.put((worker, do(worker), None))
            except BaseException as error:  # noqa: BLE001 - it is raised below
                outcomes.put((worker, None, error))

        for worker in workers:
            threading.Thread(target=run, args=(worker,), daemon=True).start()
        return self._take(outcomes, len(workers))

    def _take(self, outcomes: queue.SimpleQueue[Any], count: int) -> Iterator[tuple[Worker, Any]]:
        def wake() -> None:
            outcomes.put(None)

        with (
            self._system.ending(wake)
            if self._system
            else nullcontext(enter_result=True) as goes_on
        ):
            for _ in range(count if goes_on else 0):
                outcome = outcomes.get()
                if outcome is None:
                    return
                worker, result, error = outcome
                if error is not None:
                    raise error
                yield worker, result

    def find(self, full_name: str) -> Worker | None:
        """Return the worker that a node runs in; `None` if none."""
        return next((each for each in self._workers.values() if full_name in each.nodes), None)

    def list_nodes(self) -> list[str]:
        """Return the full names of the nodes that run in workers."""
        return [node for each in self._workers.values() if each.is_alive for node in each.nodes]

    def find_hidden(self, asking: str = '') -> frozenset[str]:
        """Return the full names of the nodes that have not started, but for one process's own.

        Args:
            asking: The worker that asks; empty for the process of the system.
        """
        hidden = self._the_system.list_hidden() if asking else frozenset()
        others = [each for each in self._workers.values() if each.name != asking]
        for worker in others:
            if not worker.is_alive or worker.assignment is None:
                hidden |= frozenset(worker.nodes)
                continue
            with suppress(ComposerError):
                hidden |= worker.call('find_hidden', timeout_sec=_ANSWER_SEC)
        return hidden

    def ask(self, what: str) -> dict[str, Any]:
        """Return what each worker answers that does, by name."""
        answers: dict[str, Any] = {}

        def ask(worker: Worker) -> None:
            with suppress(ComposerError):
                answer = worker.call(what, timeout_sec=_ANSWER_SEC)
                if answer is not None:
                    answers[worker.name] = answer

        alive = [each for each in self._workers.values() if each.is_alive]
        threads = [threading.Thread(target=ask, args=(each,), daemon=True) for each in alive]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return dict(answers)

    def describe(self) -> list[dict[str, Any]]:
        """Return the state of each worker, with the nodes that run in it."""
        return [each.describe() for each in self._workers.values()]

    def begin_edits(self, new: Reading) -> list[WorkerEdit]:
        """Return the edits by which the workers become what `new` says.

        Raises:
            ComposerError: A worker refuses; the others are as before.
        """
        edits: list[WorkerEdit] = []
        spec = new.snapshot.spec
        wanted = used_workers(spec) if self.are_used else []
        for name in dict.fromkeys([*self._workers, *wanted]):
            old, coming = self._workers.get(name), self._coming.get(name)
            if coming is not None:
                coming.assignment = self._assign(new.snapshot, name)
            if old is not None and coming is None and name in wanted:
                edits.append(ChangedWorker(old, self._assign(new.snapshot, name)))
            else:
                adopt = partial(self._adopt, name)
                timeout_sec = spec.shutdown_timeout_sec + _MARGIN_SEC
                edits.append(ReplacedWorker(old, coming, adopt, self._revive, timeout_sec))
        return edits

    @contextmanager
    def editing(
        self, new: Reading, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> Iterator[None]:
        """Edit the system in the block; it runs as `new` says afterwards, unless that raises."""
        self._aborts_goals, self._is_outdated = aborts_goals, is_outdated
        try:
            yield
            self._spec = new.snapshot.spec
        finally:
            self._aborts_goals = self._is_outdated = _never

    def _adopt(self, name: str, worker: Worker | None) -> None:
        self._coming.pop(name, None)
        if worker is None:
            self._workers.pop(name, None)
        else:
            self._workers[name] = worker

    def _revive(self, old: Worker) -> None:
        """Start a worker again that was stopped for another one that did not come."""
        again = Worker(old.spec, self._supervisor, self._functions(old.name))
        again.request, again.assignment = old.request, old.assignment
        again.spawn()
        self._workers[old.name] = again
        again.begin_again()

    def _begin_again(self, process: ExternalProcess) -> None:
        """Run the nodes of a worker again whose process was started again."""
        with self._lock:
            worker = self._worker_of(process)
            if worker is None or self._stopping:
                return
            worker.is_up = False
            self._restarting = worker
            try:
                worker.begin_again()
            except ComposerError as error:
                self._log.error(f"worker '{worker.name}' could not start again: {error}")
                if worker.is_alive:
                    # Its end is one more, after which it is started again.
                    self._supervisor.kill(process)
                return
            finally:
                self._restarting = None
        self._log.warning(f"worker '{worker.name}' was started again, with its nodes")

    def _worker_of(self, process: ExternalProcess) -> Worker | None:
        return next((each for each in self._workers.values() if each.process is process), None)

    def _tell_losses(self, process: ExternalProcess) -> None:
        worker, spec = self._worker_of(process), self._spec
        if worker is not None and worker.is_up and spec is not None:
            name = worker.name
            self._log.error(f"worker '{name}' has ended; {describe_losses(spec, name)}")

    def _act_on_end(self, process: ExternalProcess, code: int) -> None:
        worker = self._worker_of(process)
        if worker is not None and worker.is_up and worker.spec.required:
            self._log.error(f"worker '{worker.name}' is required: the system ends")
            self._end_system(ExitCode.FAILED if code else ExitCode.DONE)

    def begin_stop(self) -> None:
        """Have all workers stop, while the process of the system does."""
        self._watch.stop()
        workers = [*self._workers.values(), *self._coming.values()]
        self._stopping = len(workers)
        timeout_sec = self._supervisor.timeout_sec + _MARGIN_SEC

        def stop(worker: Worker) -> None:
            code, has_ended = worker.stop(timeout_sec)
            if not has_ended:
                self._log.error(f"worker '{worker.name}' has not stopped in time")
            self._stops.put((code, has_ended))

        for worker in workers:
            threading.Thread(target=stop, args=(worker,), daemon=True).start()

    def stop(self) -> tuple[int, bool]:
        """Wait until all have stopped, and kill what has not.

        Returns:
            The exit code, and whether all behaviours have ended.
        """
        results = [self._stops.get() for _ in range(self._stopping)]
        have_stopped = all(ended for _, ended in results)
        # What has stopped is on its way out.
        self._supervisor.timeout_sec = _EXIT_SEC if have_stopped else _KILL_SEC
        has_killed = not self._supervisor.stop()
        codes = [code for code, _ in results if code]
        return codes[0] if codes else ExitCode.DONE, have_stopped and not has_killed

    def kill_all(self) -> None:
        """Kill all at once; a signal handler may call it."""
        self._supervisor.kill_all()


def no_workers() -> Workers:
    """Return the workers of a system whose nodes all run in one process."""
    return Workers(are_used=False)


def used_workers(spec: SystemSpec) -> list[str]:
    """Return the names of the workers that nodes are in."""
    return list(dict.fromkeys(each.worker for each in spec.nodes.values() if each.worker))


def find_moved(old: SystemSpec, new: SystemSpec) -> list[str]:
    """Return the full names of the nodes that have another process in `new`."""
    before = {each.full_name: each.worker for each in old.nodes.values()}
    return [
        each.full_name
        for each in new.nodes.values()
        if before.get(each.full_name, each.worker) != each.worker
    ]


def _needs_new_process(old: WorkerSpec, new: WorkerSpec) -> bool:
    """Return whether a process cannot become what a worker says now."""
    return old.environment != new.environment or (new.nice or 0) < (old.nice or 0)


def _part(snapshot: Snapshot, name: str) -> Snapshot:
    """Return what the process of a worker is compared by; `''` is that of the system."""
    part = replace(snapshot, spec=snapshot.spec.in_worker(name))
    # These are what the whole system is compared by.
    return replace(part, sources={}, definitions={}) if name else part


def _import(worker: Worker) -> dict[str, Any]:
    """Have a worker import its behaviours; return the shapes, or errors, by name."""
    request = worker.next_request
    assert request is not None  # noqa: S101 - it was made just now
    shapes = worker.do('import_behaviours', request)
    return dict(zip([each.name for each in request.behaviours], shapes, strict=True))


def _never() -> bool:
    return False
