"""One worker, as the process of the system sees it."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, ExitCode, StartError
from composer.processes.channel import ChannelLostError
from composer.processes.external_process import describe_end
from composer.processes.guardian import STACKS_SIGNAL
from composer.processes.worker_supervisor import ConnectedProcess, worker_rules

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import WorkerSpec
    from composer.processes.channel import Channel, Functions
    from composer.processes.worker_supervisor import WorkerSupervisor
    from composer.runtime.health.system_state import Outcome
    from composer.runtime.workers.assignment import Assignment, ImportRequest

# How long it may take until it is known how a process has ended.
_END_SEC = 1.0
# How long it may take to print the stacks.
_STACKS_SEC = 0.3
# What a worker does at its start, in this order.
_STEPS = ('create', 'run_on_start', 'open', 'start_waiting', 'be_up')


class Worker:
    """A worker: its process, and what it runs.

    Args:
        list_clients: Returns the clients that it has to know before it serves.

    Attributes:
        request: What its process has imported, and imports when it is started again.
        next_request: What an edit has it import.
        assignment: What it runs, or is to run once it is started again.
        has_imported: Whether its process has imported its behaviours: from then on it answers.
        is_up: Whether all its nodes have started.
        participants: Its participants of DDS; see `LostParticipants`.
        is_silent: Whether it was told that it does not answer.
    """

    def __init__(
        self,
        spec: WorkerSpec,
        supervisor: WorkerSupervisor,
        functions: Functions,
        list_clients: Callable[[], frozenset[bytes]],
    ) -> None:
        self.spec = spec
        self.process = ConnectedProcess(spec, functions)
        self.request: ImportRequest | None = None
        self.next_request: ImportRequest | None = None
        self.assignment: Assignment | None = None
        self.has_imported = False
        self.is_up = False
        self.participants = frozenset[bytes]()
        self.is_silent = False
        self._supervisor = supervisor
        self._list_clients = list_clients

    @property
    def name(self) -> str:
        """Its name."""
        return self.spec.name

    @property
    def is_alive(self) -> bool:
        """Whether its process runs."""
        run = self.process.run
        return run is not None and run.code is None

    @property
    def channel(self) -> Channel:
        """The connection to its process."""
        assert self.process.channel is not None  # noqa: S101 - it was spawned
        return self.process.channel

    @property
    def nodes(self) -> list[str]:
        """The full names of the nodes that it runs, or is to run."""
        if self.assignment is None:
            return []
        return [each.full_name for each in self.assignment.snapshot.spec.nodes.values()]

    def spawn(self) -> None:
        """Start its process.

        Raises:
            StartError: It cannot be started.
        """
        self._supervisor.start(self.process)

    def call(self, name: str, *arguments: Any, timeout_sec: float | None = None) -> Any:
        """Call a function of its process.

        Raises:
            ComposerError: The function raised it, or the process has gone.
        """
        return self.channel.call(name, *arguments, timeout_sec=timeout_sec)

    def do(self, step: str, *arguments: Any) -> Any:
        """Do one step of its start; see `WorkerProcess`.

        Raises:
            StartError: It failed.
        """
        if step == 'create':
            arguments = (self.assignment, self._list_clients())
        try:
            result = self.call(step, *arguments)
        except ChannelLostError as error:
            raise self.failed_start() from error
        if step == 'create':
            self.process.mark, self.participants = result
        return result

    def import_behaviours(self) -> dict[str, Any]:
        """Have its process import what comes next.

        Returns:
            The `Shape` of each behaviour, or the text and the help of an error, by name.

        Raises:
            StartError: A module has ended the process.
        """
        request = self.next_request
        assert request is not None  # noqa: S101 - it was made just before
        shapes = self.do('import_behaviours', request)
        self.has_imported = True
        return dict(zip([each.name for each in request.behaviours], shapes, strict=True))

    def start(self) -> None:
        """Do all steps of its start, beside a system that is up.

        Raises:
            ComposerError: One failed.
        """
        for step in _STEPS:
            self.do(step)
        self.is_up = True
        self.keep_to_rules()

    def begin_again(self) -> None:
        """Run its nodes in a process that was started anew.

        Raises:
            ComposerError: They could not start.
        """
        self.is_up = self.has_imported = False
        self.do('import_behaviours', self.request)
        self.has_imported = True
        self.do('keep_imports')
        self.start()

    def keep_to_rules(self) -> None:
        """Have its process started again as the file says."""
        self.process.change(worker_rules(self.spec))

    def stop(self, timeout_sec: float) -> tuple[int, bool]:
        """Stop its nodes and end its process.

        Returns:
            The exit code, and whether all behaviours have ended.
        """
        self.leave()
        if not self.is_alive:
            return ExitCode.DONE, True
        if not self.has_imported:
            # It runs nothing yet, and does not answer before it has imported ROS.
            self._supervisor.kill(self.process)
            return ExitCode.DONE, True
        try:
            code, has_ended = self.call('stop', timeout_sec=timeout_sec)
        except ComposerError:
            self.print_stacks()
            self._supervisor.kill(self.process)
            return ExitCode.FAILED, False
        self.channel.tell('end')
        run = self.process.run
        if run is not None:
            run.gone.wait(_END_SEC)
        return code, has_ended

    def print_stacks(self) -> None:
        """Have it print where its threads are, whatever they do; a stopped one cannot."""
        run = self.process.run
        if run is not None and run.code is None:
            with suppress(ProcessLookupError):
                os.kill(run.pid, STACKS_SIGNAL)
            run.ended.wait(_STACKS_SEC)

    def leave(self) -> None:
        """Have it not be started again."""
        self.process.is_leaving = True

    def remove(self, timeout_sec: float) -> None:
        """Stop it, and have its process killed if it does not end."""
        self.stop(timeout_sec)
        self._supervisor.end(self.process)

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node anew."""
        outcome: Outcome = self.call('restart_node', full_name)
        return outcome

    def describe(self) -> dict[str, Any]:
        """Return its state as data."""
        run = self.process.run
        state = 'running' if self.is_up else 'starting'
        if self.is_silent:
            state = 'no answer'
        if not self.is_alive:
            state = 'ended' if self.process.is_done else 'restarting'
        return {
            'name': self.name,
            'state': state,
            'pid': run.pid if run is not None and self.is_alive else None,
            'restarts': self.process.restarts,
            'nodes': self.nodes,
        }

    def failed_start(self) -> StartError:
        """Return what to raise when its process has ended while it started."""
        run = self.process.run
        if run is not None:
            run.ended.wait(_END_SEC)
        if run is None or run.code is None:
            return StartError(f"worker '{self.name}' does not answer")
        names = '' if self.has_imported else ', '.join(map(repr, self.spec.environment))
        advice = f"do Python and ROS start with its 'environment', which sets {names}?"
        message = f"worker '{self.name}' {describe_end(run.code)} while it started"
        return StartError(message, help=advice if names else None)
