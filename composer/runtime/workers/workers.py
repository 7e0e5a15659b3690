"""The workers of a system, as the process of the system sees them.

Nothing of ROS is imported here: workers are started before this process imports ROS, so that all
import it at the same time.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

from composer.errors import ComposerError, ExitCode
from composer.language.bindings import system_bindings
from composer.network.transport_profile import shared_memory_variables
from composer.processes.kernel import (
    PROCESS_KEEPER_THREADS,
    SYSTEM_THREADS,
    WORKER_KEEPER_THREADS,
    WORKER_THREADS,
    check_threads,
)
from composer.runtime.rewiring.order_of_ends import order_ends
from composer.runtime.workers.assignment import Assignment, ImportRequest
from composer.runtime.workers.at_once import ANSWER_SEC, ask_all, do_at_once
from composer.runtime.workers.system_calls import SystemCalls
from composer.runtime.workers.worker import Worker
from composer.runtime.workers.worker_edits import ChangedWorker, ReplacedWorker
from composer.runtime.workers.worker_keeper import KILL_SEC, WorkerKeeper
from composer.runtime.workers.worker_watch import WorkerWatch

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
    from pathlib import Path

    from composer.language.bindings import Binding
    from composer.language.specs import SystemSpec, WorkerSpec
    from composer.planning.snapshot import Snapshot
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.workers.system_calls import SystemOfWorkers
    from composer.runtime.workers.worker_edits import WorkerEdit

# How much longer than its behaviours a worker may take to stop.
_MARGIN_SEC = 1.0
# How long a process may take to exit that has stopped.
_EXIT_SEC = 5.0


class Workers:
    """Starts, asks, edits and stops the workers of a system.

    As a context manager, it ends those that no system has got.

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
        # Those that the start, or an edit, brings.
        self._coming: dict[str, Worker] = {}
        self._calls = SystemCalls(self.find_hidden)
        self._keeper = WorkerKeeper(self._list, self._calls.request_stop, self._calls.lose_servers)
        self._supervisor = self._keeper.supervisor
        self._watch = WorkerWatch(self._list, self._keeper.log)
        self._stops: queue.SimpleQueue[tuple[int, bool]] = queue.SimpleQueue()
        self._stopping = 0
        self._is_bound = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        if not self._is_bound:
            for worker in self._coming.values():
                self._supervisor.kill(worker.process)
            self._supervisor.stop()

    def _list(self) -> list[Worker]:
        return list(self._workers.values())

    @property
    def names(self) -> list[str]:
        """The names of the workers that have nodes."""
        return list(self._workers)

    def own_part(self, reading: Reading) -> Reading:
        """Return what the process of the system runs itself."""
        if not self.are_used:
            return reading
        snapshot = part_of(reading.snapshot, '')
        return replace(reading, spec=snapshot.spec, snapshot=snapshot)

    def give_room(self, spec: SystemSpec, *, sends_big: bool) -> None:
        """Have the first workers, if an edit brings them, get large segments of shared memory.

        Args:
            sends_big: Whether big messages cross.
        """
        if self._workers or not (self.are_used and used_workers(spec)):
            return
        try:
            self._supervisor.variables = shared_memory_variables(spec, os.environ)
        except ComposerError as error:
            self._keeper.log.warning(f'network: {error}')
            return
        if self._supervisor.variables and sends_big:
            self._keeper.log.warning(
                'network: the process of the system has little shared memory until the system '
                'starts again: what its nodes send to workers in messages of more than 512 KB '
                'goes over UDP, where it may be lost'
            )

    def spawn(self, spec: SystemSpec) -> None:
        """Start the processes of all workers of a system; those that run, or come, already go on.

        One that needs another process gets it beside the old one, which goes later.

        Raises:
            StartError: A process cannot be started.
        """
        both = {**self._workers, **self._coming}
        wanted = [spec.workers[name] for name in used_workers(spec)] if self.are_used else []
        wanted = [
            each
            for each in wanted
            if each.name not in both or needs_new_process(both[each.name].spec, each)
        ]
        keepers = WORKER_KEEPER_THREADS if wanted else 0
        threads = 0 if self._is_bound else SYSTEM_THREADS + _process_threads(spec)
        check_threads(threads + keepers + WORKER_THREADS * len(wanted))
        for each in wanted:
            functions = self._calls.functions_for(each.name)
            worker = Worker(each, self._supervisor, functions, self._calls.list_clients)
            worker.spawn()
            # Only now: the early start tells no error, and the next one tries again.
            self._coming[each.name] = worker

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
        # One that is being started again imports them then.
        alive = [each for each in workers if each.is_alive]
        return (
            (binding, shapes[binding.behaviour.name])
            for worker, shapes in do_at_once(alive, Worker.import_behaviours, self._calls.ending)
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
        with self._keeper.resting():
            try:
                yield
            except BaseException:
                self._call_each('drop_imports')
                coming, self._coming = list(self._coming.values()), {}
                for worker in coming:
                    worker.remove(KILL_SEC)
                raise
            self._call_each('keep_imports')
            for worker in {**self._workers, **self._coming}.values():
                worker.request = worker.next_request

    def _call_each(self, name: str) -> None:
        for worker in {**self._workers, **self._coming}.values():
            if worker.is_alive:
                with suppress(ComposerError):
                    worker.call(name)

    def bind(self, system: SystemOfWorkers, reading: Reading) -> None:
        """Be the workers of a system that runs as `reading`, from its start on."""
        self._is_bound = True
        self._calls.system = system
        self._workers, self._coming = self._coming, {}
        self._supervisor.timeout_sec = reading.spec.shutdown_timeout_sec
        for name, worker in self._workers.items():
            worker.assignment = self._assign(reading.snapshot, name)
        if self.are_used:
            self._watch.start()

    def _assign(self, snapshot: Snapshot, name: str) -> Assignment:
        worker, part = snapshot.spec.workers[name], part_of(snapshot, name)
        return Assignment(worker, part, self._ros_arguments, self._log_levels)

    @contextmanager
    def together(self, step: str) -> Iterator[list[Any]]:
        """Have all workers do a step of their start while the block runs; wait for all.

        Yields:
            What they return, once the block has ended.

        Raises:
            ComposerError: One of them failed; the others may still be at it.
        """
        results: list[Any] = []
        outcomes = do_at_once(self._list(), lambda each: each.do(step), self._calls.ending)
        yield results
        results += [result for _, result in outcomes]

    def keep_up(self, spec: SystemSpec) -> None:
        """Keep all workers up from now on, as the file says.

        Raises:
            StartError: One has ended already.
        """
        self._keeper.spec = spec
        for worker in self._list():
            worker.is_up = True
            worker.keep_to_rules()
        for worker in self._list():
            if not worker.is_alive:
                raise worker.failed_start()

    def be_up(self) -> None:
        """Tell all workers that the system has started."""
        self._supervisor.tell_ends()
        self.tell_all('be_up')

    def tell_all(self, what: str, *arguments: Any) -> None:
        """Tell all workers something."""
        for worker in self._list():
            with suppress(ComposerError):
                worker.channel.tell(what, *arguments)

    def find(self, full_name: str) -> Worker | None:
        """Return the worker that a node runs in; `None` if none."""
        return next((each for each in self._list() if full_name in each.nodes), None)

    def list_nodes(self) -> list[str]:
        """Return the full names of the nodes that run in workers."""
        return [node for each in self._list() if each.is_alive for node in each.nodes]

    def find_hidden(self, asking: str = '') -> frozenset[str]:
        """Return the full names of the nodes that have not started, but for one process's own.

        Args:
            asking: The worker that asks; empty for the process of the system.
        """
        hidden = self._calls.list_hidden() if asking else frozenset()
        for worker in self._list():
            if worker.name == asking:
                continue
            if not worker.is_alive:
                hidden |= frozenset(worker.nodes)
                continue
            with suppress(ComposerError):
                hidden |= worker.call('find_hidden', timeout_sec=ANSWER_SEC)
        return hidden

    def ask(self, what: str, *arguments: Any, timeout_sec: float = ANSWER_SEC) -> dict[str, Any]:
        """Return what each worker answers that does, by name."""
        return ask_all(self._list(), what, *arguments, timeout_sec=timeout_sec)

    def describe(self) -> list[dict[str, Any]]:
        """Return the state of each worker, with the nodes that run in it."""
        return [each.describe() for each in self._list()]

    def begin_edits(self, new: Reading) -> list[WorkerEdit]:
        """Return the edits by which the workers become what `new` says."""
        edits: list[WorkerEdit] = []
        snapshot = new.snapshot
        wanted = used_workers(snapshot.spec) if self.are_used else []
        timeout_sec = snapshot.spec.shutdown_timeout_sec + _MARGIN_SEC
        for name in dict.fromkeys([*self._workers, *wanted]):
            old, coming = self._workers.get(name), self._coming.get(name)
            if coming is not None:
                coming.assignment = self._assign(snapshot, name)
            if old is not None and coming is None and name in wanted:
                edits.append(ChangedWorker(old, self._assign(snapshot, name)))
            else:
                adopt = partial(self._adopt, name)
                edits.append(ReplacedWorker(old, coming, adopt, timeout_sec))
        return edits

    def find_ending(self, old: SystemSpec, new: SystemSpec) -> Iterator[list[str]]:
        """Yield the nodes that end in their process before others begin, as `order_ends` does."""
        if not self.are_used:
            return
        moved = set(find_moved(old, new))
        # A name is that of one node: all of them end for those of the new process.
        replaced = self._workers.keys() & self._coming.keys()
        yield from order_ends(
            each
            for each in old.nodes.values()
            if each.full_name in moved or each.worker in replaced
        )

    @contextmanager
    def editing(
        self, new: Reading, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> Iterator[None]:
        """Edit the system in the block; it runs as `new` says afterwards, unless that raises."""
        with self._calls.editing(aborts_goals, is_outdated):
            yield
        self._keeper.spec = new.snapshot.spec

    def _adopt(self, name: str, worker: Worker | None) -> None:
        self._coming.pop(name, None)
        if worker is None:
            self._workers.pop(name, None)
        else:
            self._workers[name] = worker

    def begin_stop(self) -> None:
        """Have all workers stop, while the process of the system does."""
        self._watch.stop()
        self._keeper.is_stopping = True
        workers = [*self._list(), *self._coming.values()]
        self._stopping = len(workers)
        timeout_sec = self._supervisor.timeout_sec + _MARGIN_SEC

        def stop(worker: Worker) -> None:
            code, has_ended = worker.stop(timeout_sec)
            if not has_ended:
                self._keeper.log.error(f"worker '{worker.name}' has not stopped in time")
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
        self._supervisor.timeout_sec = _EXIT_SEC if have_stopped else KILL_SEC
        none_killed = self._supervisor.stop()
        codes = [code for code, _ in results if code]
        return codes[0] if codes else ExitCode.DONE, have_stopped and none_killed

    def kill_all(self) -> None:
        """Kill all at once; a signal handler may call it."""
        self._supervisor.kill_all()


def _process_threads(spec: SystemSpec) -> int:
    """Return how many threads the external processes need that start with a system."""
    own = [each for each in spec.processes.values() if not each.external]
    at_start = [each for each in own if not (each.on_demand or each.wait_for)]
    return len(at_start) + PROCESS_KEEPER_THREADS if at_start else 0


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


def needs_new_process(old: WorkerSpec, new: WorkerSpec) -> bool:
    """Return whether a process cannot become what a worker says now."""
    return old.environment != new.environment or (new.nice or 0) < (old.nice or 0)


def part_of(snapshot: Snapshot, name: str) -> Snapshot:
    """Return what the process of a worker is compared by; `''` is that of the system."""
    spec = snapshot.spec.in_worker(name)
    if not name:
        return replace(snapshot, spec=spec)
    if level := spec.workers[name].log_level:
        nodes = {
            key: node if node.log_level else replace(node, log_level=level)
            for key, node in spec.nodes.items()
        }
        spec = replace(spec, nodes=nodes)
    # What is left out is what the whole system is compared by.
    return replace(snapshot, spec=spec, sources={}, definitions={})
