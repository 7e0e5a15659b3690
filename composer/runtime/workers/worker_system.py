"""The part of a system that a worker runs: a system that another process starts and stops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.processes.guardian_client import NoGuardian, mark_process
from composer.records import record
from composer.runtime.health.introductions import Introductions
from composer.runtime.local_part import LocalPart
from composer.runtime.rewiring.reading import Reading
from composer.runtime.workers.workers import no_workers

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import ProcessState, WorkerSpec
    from composer.planning.snapshot import Snapshot
    from composer.processes.channel import Channel
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.workers.assignment import Assignment


class WorkerSystem(LocalPart):
    """A system whose start, edits and stop another process directs.

    Args:
        functions: Its behaviours, by their names.
        channel: To the process of the system.

    Attributes:
        is_told_to_stop: Whether that process has asked for the stop.
    """

    def __init__(
        self,
        assignment: Assignment,
        functions: Mapping[str, Callable[..., Any]],
        channel: Channel,
    ) -> None:
        self._channel = channel
        self._worker = assignment.worker
        self.label = f"worker '{self._worker.name}'"
        self.is_told_to_stop = False
        self.workers = no_workers()
        super().__init__(
            self.read(assignment.snapshot, functions),
            _Keeper(channel),
            SystemProcess(channel),
            assignment.ros_arguments,
            assignment.log_levels,
            # Of hosts that are gone, the process of the system tells.
            observers=[Introductions()],
            worker=self._worker.name,
        )

    @staticmethod
    def read(snapshot: Snapshot, functions: Mapping[str, Callable[..., Any]]) -> Reading:
        """Return what a worker is to run as."""
        return Reading(snapshot.spec, snapshot.positions, functions, snapshot)

    @property
    def _most_threads(self) -> int | None:
        return self._worker.threads or super()._most_threads

    def limit_threads(self, spec: WorkerSpec) -> None:
        """Run as many callbacks at a time as a worker says."""
        self._worker = spec
        self._executor.limit_threads(self._most_threads)

    @property
    def mark(self) -> int:
        """What marks the processes that behaviours start here; 0 for nothing."""
        return self._guardian.mark

    def fail_request(self, failure: RequestFailure) -> None:
        """See `LocalPart`: the process of the system tells all."""
        self._channel.tell('fail_request', failure)

    def take_failure(self, failure: RequestFailure) -> None:
        """End the call that waits for the response to a request, if it is in this process."""
        super().fail_request(failure)

    def shutdown(self, code: int) -> None:
        """Ask for the end of the whole system."""
        self._channel.tell('request_stop', code)

    def describe_status(self) -> dict[str, Any]:
        """Return what this process says of itself."""
        return self._control.describe_status()

    def describe_top(self) -> dict[str, Any] | None:
        """Return the health of the entities; `None` if nothing is measured."""
        return self._control.describe_top()


class _Keeper(NoGuardian):
    """Stands for the guardian of a worker: the process of the system ends one that hangs."""

    def __init__(self, channel: Channel) -> None:
        super().__init__(owns_process=True)
        self._channel = channel
        # What its behaviours start ends with the worker.
        self.mark = mark_process()

    def begin_stop(self) -> bool:
        """Return whether the descriptors of this process are still its own."""
        return self._channel.is_intact


@record
class SystemProcess:
    """The process of the system, as its workers see it; see `Elsewhere`."""

    channel: Channel

    def find_process(self, name: str) -> AwaitedProcess:
        """Return an external process."""
        return AwaitedProcess(self.channel, name)

    def find_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes of other processes that have not started."""
        hidden: frozenset[str] = self.channel.call('find_hidden')
        return hidden


@record
class AwaitedProcess:
    """An external process, which the process of the system supervises."""

    channel: Channel
    name: str

    @property
    def is_done(self) -> bool:
        """Whether it has ended for good."""
        return bool(self.channel.call('process_state', self.name)[0])

    @property
    def state(self) -> str:
        """Its state in words."""
        return str(self.channel.call('process_state', self.name)[1])

    def has_come_to(self, state: ProcessState | None) -> bool:
        """Return whether it is in a state."""
        return bool(self.channel.call('process_has_come_to', self.name, state))
