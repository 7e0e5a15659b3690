"""Starts workers again that have ended, and tells what goes with them."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

from composer.checks.connections.topology import full_name
from composer.errors import ComposerError, ExitCode
from composer.processes.worker_supervisor import WorkerSupervisor

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from composer.language.specs import (
        DeclaredEndSpec,
        DeclaredNodeSpec,
        EndSpec,
        NodeSpec,
        SystemSpec,
    )
    from composer.processes.external_process import ExternalProcess
    from composer.runtime.workers.worker import Worker
    from composer.terminal import EscapingLogger

# How long an edit waits for a worker that is being started again.
_RESTART_SEC = 10.0
# How long what does not stop gets to end.
KILL_SEC = 0.5
# The sections whose ends give something, those that take it, and what these do without it.
_GIVEN = {
    'publishers': ('subscriptions', 'gets nothing on'),
    'services': ('service_clients', 'has nobody to call at'),
    'actions': ('action_clients', 'has nobody to send goals to at'),
}
_MOST = 5


class _LazyLogger:
    """The logger of the system, for what is made before ROS is imported."""

    def __getattr__(self, level: str) -> Any:
        from composer.runtime.logs import system_logger

        return getattr(system_logger, level)


class WorkerKeeper:
    """Keeps the workers of a system up.

    Args:
        list_workers: Returns those that there are.
        end_system: Ends the system with an exit code.
        lose_servers: Ends what waits for servers of participants of DDS that were killed.

    Attributes:
        supervisor: Runs their processes.
        log: The logger of the system.
        spec: The system; `None` until all of it is up.
        is_stopping: Whether none is started again.
    """

    def __init__(
        self,
        list_workers: Callable[[], Iterable[Worker]],
        end_system: Callable[[int], None],
        lose_servers: Callable[[frozenset[bytes]], None],
    ) -> None:
        self.log = cast('EscapingLogger', _LazyLogger())
        self.supervisor = WorkerSupervisor(self.log, end_system, KILL_SEC)
        self.supervisor.on_end = self._tell_losses
        self.supervisor.on_restart = self._begin_again
        self.supervisor.on_exit = self._act_on_end
        self.spec: SystemSpec | None = None
        self.is_stopping = False
        self._list_workers = list_workers
        self._end_system = end_system
        self._lose_servers = lose_servers
        # Held while a worker is started again, or the system edited.
        self._lock = threading.Lock()
        self._restarting: Worker | None = None

    @contextmanager
    def resting(self) -> Iterator[None]:
        """Start none again while the block runs; one that takes long begins anew later."""
        while not self._lock.acquire(timeout=_RESTART_SEC):
            if self._restarting is not None:
                self.supervisor.kill(self._restarting.process)
        try:
            yield
        finally:
            self._lock.release()

    def _begin_again(self, process: ExternalProcess) -> None:
        """Run the nodes of a worker again whose process was started again."""
        run = process.run
        with self._lock:
            if process.run is not run:
                return  # It has ended, and was started again, while an edit was under way.
            worker = self._worker_of(process)
            if worker is None or self.is_stopping:
                # An edit has let go of it while it was being started.
                self.supervisor.kill(process)
                return
            self._restarting = worker
            try:
                worker.begin_again()
            except ComposerError as error:
                if not self.is_stopping:
                    self.log.error(f"worker '{worker.name}' could not start again: {error}")
                if worker.is_alive:
                    # Its end is one more, after which it is started again.
                    self.supervisor.kill(process)
                return
            finally:
                self._restarting = None
        self.log.warning(f"worker '{worker.name}' was started again, with its nodes")

    def _worker_of(self, process: ExternalProcess) -> Worker | None:
        return next((each for each in self._list_workers() if each.process is process), None)

    def _tell_losses(self, process: ExternalProcess) -> None:
        worker = self._worker_of(process)
        if worker is None:
            return
        # Before it is started again: what comes then has the same names.
        self._lose_servers(worker.participants)
        if worker.is_up and self.spec is not None:
            name = worker.name
            self.log.error(f"worker '{name}' has ended; {describe_losses(self.spec, name)}")

    def _act_on_end(self, process: ExternalProcess, code: int) -> None:
        worker = self._worker_of(process)
        if worker is not None and worker.spec.required and self.spec is not None:
            self.log.error(f"worker '{worker.name}' is required: the system ends")
            self._end_system(ExitCode.FAILED if code else ExitCode.DONE)


def describe_losses(spec: SystemSpec, worker: str) -> str:
    """Return in words which nodes go with a worker, and what the others do not have then."""
    gone, left = _split(spec, worker)
    names = {node.full_name for node in gone}
    nodes = 'its node is' if len(names) == 1 else f'its {len(names)} nodes are'
    text = f'{nodes} gone: {_list(sorted(names))}'
    lines = list(_describe_ends(gone, left))
    return '\n'.join([text, *(f'  {line}' for line in lines)])


def _split(
    spec: SystemSpec, worker: str
) -> tuple[list[NodeSpec], list[NodeSpec | DeclaredNodeSpec]]:
    """Return the nodes of a worker, and all others."""
    gone = [node for node in spec.nodes.values() if node.worker == worker]
    names = {node.full_name for node in gone}
    return gone, [node for node in spec.end_owners() if node.full_name not in names]


def _describe_ends(
    gone: Collection[NodeSpec], left: Collection[NodeSpec | DeclaredNodeSpec]
) -> Iterator[str]:
    for giving, (taking, lack) in _GIVEN.items():
        lost = _channels(gone, giving) - _channels(left, giving)
        for node in left:
            missed = sorted(_channels([node], taking) & lost)
            if missed:
                yield f"'{node.full_name}' {lack} {_list(missed)}"


def _channels(nodes: Collection[NodeSpec | DeclaredNodeSpec], section: str) -> set[str]:
    return {
        full_name(node, kind.channel, _channel_of(end, kind.channel))
        for node in nodes
        for kind, end in node.ends()
        if kind.section == section and kind.channel is not None
    }


def _channel_of(end: EndSpec | DeclaredEndSpec, channel: str) -> str:
    """Return the name of the topic, service or action of an end, as written."""
    return str(getattr(end, 'channel', None) or getattr(end, channel))


def _list(names: list[str]) -> str:
    shown = ', '.join(f"'{each}'" for each in names[:_MOST])
    rest = len(names) - _MOST
    return f'{shown} and {rest} more' if rest > 0 else shown
