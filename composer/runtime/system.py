"""`SystemSpec` → a running system: all of it starts or nothing, and all of it stops cleanly."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.errors import ExitCode, StartError
from composer.names import count_of
from composer.planning.differences import compare
from composer.runtime.health.introductions import Introductions
from composer.runtime.health.other_hosts import OtherHosts
from composer.runtime.local_part import LocalPart
from composer.runtime.logs import system_logger
from composer.runtime.workers.workers import no_workers

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from composer.planning.plan import Plan
    from composer.planning.snapshot import Snapshot
    from composer.processes.external_process import ExternalProcess
    from composer.processes.guardian_client import GuardianClient, NoGuardian
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.control.control_services import Commands
    from composer.runtime.health.system_state import Outcome
    from composer.runtime.local_part import SystemRecorder
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.stop_request import StopRequest
    from composer.runtime.tracing.tracer import TracePart
    from composer.runtime.workers.workers import Workers

# How long a worker may take to hand its trace over.
_TRACE_SEC = 10.0
_POLL_SEC = 0.02
# Who has forgotten it does not come back.
_LONGEST_HOLD_SEC = 60.0


class System(LocalPart):
    """A system that can be started once and stopped once: what runs here, and its workers.

    Args:
        reading: What it runs as.
        guardian: See `LocalPart`, as for what is not listed here.
        commands: What it does with its files when it is asked; `None` if it is not to be asked.
        workers: Run the nodes that are in workers; `None` if all run in this process.

    Attributes:
        hold: While this file is there, no behaviour starts; `None` for no such file.
        write_trace: Takes what all processes have noted from the start to the stop; `None` if
            nobody wants it.
    """

    def __init__(  # noqa: PLR0913 - one for each part
        self,
        reading: Reading,
        guardian: GuardianClient | NoGuardian,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
        *,
        stop_request: StopRequest | None = None,
        commands: Commands | None = None,
        recorder: SystemRecorder | None = None,
        workers: Workers | None = None,
    ) -> None:
        self.workers: Workers = workers or no_workers()
        self.hold: Path | None = None
        self._whole = reading
        super().__init__(
            self.workers.own_part(reading),
            guardian,
            self,
            ros_arguments,
            log_levels,
            stop_request=stop_request,
            commands=commands,
            recorder=recorder,
            observers=(Introductions(), OtherHosts(lambda: self._whole.spec)),
        )
        self._processes.is_alone = not reading.spec.nodes
        self.workers.bind(self, reading)

    def start(self) -> None:
        """Create all nodes and entities, run `on_start`, then let the behaviours run.

        No `on_start` runs before all nodes are created, those in workers, too. External processes
        start before any `on_start`. What has a `wait_for` or a `delay` starts last, while
        the behaviours of all others run. If a node cannot start, the `on_stop` of those that
        have started is run.

        Raises:
            StartError: Something could not start; all the rest has been stopped again.
        """
        together = self.workers.together
        if self.write_trace is not None:
            self.begin_trace()
        try:
            with together('create'):
                self.create()
            if self.hold is not None:
                wait_until_let_go(self.hold, lambda: self.stop_requested)
                if self.stop_requested:
                    return
            with together('run_on_start') as wait_elsewhere:
                waits = self.run_on_start()
            if (waits or any(wait_elsewhere)) and not self.stop_requested:
                with together('open'):
                    self.open()
                with together('start_waiting'):
                    self.start_waiting()
            if not self.stop_requested:
                self.workers.keep_up(self._whole.spec)
        except BaseException:
            self.stop()
            raise
        if self.stop_requested:
            return
        # Who reads the line may stop the system at once.
        self._stop_request.system_is_up = True
        self._tell_start()
        self.workers.be_up()
        self.be_up()

    def _tell_start(self) -> None:
        parts = _describe_parts(
            node=len(self._whole.spec.nodes),
            component=len(self.list_components()),
            process=sum(not each.spec.external for each in self._processes.by_name.values()),
            worker=len(self.workers.names),
        )
        system_logger.info(f'{self.state.name}: {parts} ready in {self.state.uptime_sec:.2f} s')

    def rewire(
        self, new: Reading, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> Plan:
        """Become the system of `new`; return what was done.

        Args:
            aborts_goals: Returns whether goals of actions that go are aborted, not waited for.
            is_outdated: Returns whether there is a newer edit; then nothing is waited for.

        Raises:
            ComposerError: That failed, and the system is as it was.
        """
        plan = compare(self.snapshot, new.snapshot)
        # There may be none, and each edit begins with this.
        ending = list(self.workers.find_ending(self._whole.spec, new.spec)) or [[]]
        edits = [self.begin_edit(self.workers.own_part(new)), *self.workers.begin_edits(new)]
        with self.workers.editing(new, aborts_goals, is_outdated):
            try:
                for each in edits:
                    each.wait_for_goals(aborts_goals, is_outdated)
                for names in ending:
                    for each in edits:
                        each.make_way(names)
                for each in edits:
                    each.apply(is_outdated)
            except BaseException:
                for each in reversed(edits):
                    each.undo()
                raise
            for each in edits:
                each.commit()
            self._whole = new
            self._processes.is_alone = not new.spec.nodes
        return plan

    def ending(self, end: Callable[[], None]) -> AbstractContextManager[bool]:
        """Have `end` called if a stop is requested before the block ends; see `StopRequest`."""
        return self._stop_request.waking(end)

    @property
    def snapshot(self) -> Snapshot:
        """What it runs as, as its files say it."""
        return replace(self._whole.snapshot, set_live=super().snapshot.set_live)

    def list_nodes(self) -> list[str]:
        """Return the full names of its nodes."""
        return [*super().list_nodes(), *self.workers.list_nodes()]

    def find_process(self, name: str) -> ExternalProcess:
        """Return an external process; see `Elsewhere`."""
        return self._processes.by_name[name]

    def find_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes in workers that have not started."""
        return self.workers.find_hidden()

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node or component anew, wherever it runs; see `LocalPart`."""
        if (worker := self.workers.find(full_name)) is not None:
            return worker.restart_node(full_name)
        return super().restart_node(full_name)

    def begin_trace(self) -> None:
        """See `LocalPart`."""
        super().begin_trace()
        self.workers.tell_all('begin_trace')

    def end_traces(self) -> dict[str, TracePart]:
        """See `LocalPart`."""
        return {**super().end_traces(), **self.workers.ask('end_trace', timeout_sec=_TRACE_SEC)}

    def _stop_nodes(self) -> bool:
        """Stop all nodes, those in workers, too; return whether those of this process ended."""
        if self.write_trace is not None:
            self.write_trace(self.end_traces())
        self.workers.begin_stop()
        ended = super()._stop_nodes()
        code, ended_elsewhere = self.workers.stop()
        for each in (code, ExitCode.DONE if ended_elsewhere else ExitCode.FAILED):
            if each:
                self._stop_request.set_code(each)
        return ended

    def lose_all_servers(self, participants: frozenset[bytes]) -> None:
        """End what waits, in any process, for servers of a process that was killed."""
        self.lose_servers(participants)
        self.workers.ask('lose_servers', participants)

    def fail_request(self, failure: RequestFailure) -> None:
        """See `LocalPart`."""
        super().fail_request(failure)
        self.workers.tell_all('fail_request', failure)

    def _kill_processes(self) -> None:
        self.workers.kill_all()
        super()._kill_processes()


def _describe_parts(**counts: int) -> str:
    """Return `2 nodes, 3 components and 1 process`; what there is none of is left out."""
    parts = [count_of(number, noun) for noun, number in counts.items() if number]
    *first, last = parts or ['0 nodes']
    return f'{", ".join(first)} and {last}' if first else last


def wait_until_let_go(path: Path, is_stopping: Callable[[], bool]) -> None:
    """Write the process ID to a file, and wait until the file is gone; without it, do nothing.

    So the parts of a system on several hosts start their behaviours together: who starts them
    waits until each is held, and removes the files.

    Args:
        is_stopping: Returns whether to wait no longer.

    Raises:
        StartError: It was there for too long, and is removed; or it cannot be written.
    """
    try:
        with path.open('r+') as stream:
            stream.write(f'{os.getpid()}\n')
    except FileNotFoundError:
        return
    except OSError as error:
        message = f'the system cannot tell that it is held: {path}: {error.strerror}'
        raise StartError(message) from error
    deadline = time.monotonic() + _LONGEST_HOLD_SEC
    while path.exists() and not is_stopping():
        if time.monotonic() > deadline:
            path.unlink(missing_ok=True)
            message = f'nobody has removed {path} within {_LONGEST_HOLD_SEC:g} s'
            raise StartError(message)
        time.sleep(_POLL_SEC)
