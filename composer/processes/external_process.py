"""An external process and its runs: its state, how it ended, and whether it is started again."""

from __future__ import annotations

import queue
import signal
import threading
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.processes.backoff import Backoff

if TYPE_CHECKING:
    from composer.language.specs import ProcessSpec, ProcessState


@dataclass(slots=True)
class ProcessRun:
    """One run of a process.

    Attributes:
        number: Identifies the run in requests to the reaper and in its answers.
        output_ended: Set when no process holds its output open any more.
        code: The exit code, or a signal's number, negative; `None` while it runs.
        answer: The reaper's answer to the request to start it.
        has_failed: Whether it was ended because it did not do what it was to do.
        ended: Set when `code` is known.
        is_given_up: Whether it was killed on purpose.
        gone: Set when nothing of its process group is left.
        pid: Its process ID.
        is_replaced: Whether it was ended for another run to begin.
        measured_at: When `cpu_sec` was read, a time of `time.monotonic`.
        cpu_sec: The processor time that it had used then.
        cpu: The share of a core that it used in the time before.
    """

    number: int
    process: ExternalProcess
    output_ended: threading.Event
    code: int | None = None
    answer: queue.SimpleQueue[dict[str, Any]] = field(default_factory=queue.SimpleQueue)
    ended: threading.Event = field(default_factory=threading.Event)
    gone: threading.Event = field(default_factory=threading.Event)
    pid: int = 0
    was_killed: bool = False
    has_failed: bool = False
    is_given_up: bool = False
    is_replaced: bool = False
    measured_at: float = field(default_factory=monotonic)
    cpu_sec: float = 0.0
    cpu: float | None = None


class ExternalProcess:
    """A process of the system.

    Attributes:
        run: The last one; `None` before the first.
        restarts: How often it was started again.
        is_done: Whether it has ended for good.
        is_acting: Whether its `on_exit` is under way.
        is_leaving: Whether the system has let go of it.
    """

    def __init__(self, spec: ProcessSpec) -> None:
        self.spec = spec
        self.run: ProcessRun | None = None
        self.restarts = 0
        self.is_done = False
        self.is_acting = False
        self.is_leaving = False
        # A process that keeps dying is started again ever more slowly, as nodes are.
        self.backoff = Backoff(least_sec=spec.restart_delay_sec)

    def change(self, spec: ProcessSpec) -> None:
        """Be kept as `spec` says from now on; it runs as before."""
        self.spec = spec
        self.backoff.least_sec = spec.restart_delay_sec

    @property
    def is_over(self) -> bool:
        """Whether nothing is to come of it: it has ended for good, or is not asked for."""
        is_unasked = (self.spec.on_demand or self.spec.external) and self.run is None
        return (self.is_done or is_unasked) and not self.is_acting

    @property
    def has_succeeded(self) -> bool:
        """Whether its last run has ended with exit code 0."""
        return self.run is not None and self.run.code == 0

    def has_come_to(self, state: ProcessState | None) -> bool:
        """Return whether it is in a state; without one, whether it runs or has succeeded."""
        if state == 'ended':
            return self.is_done
        if state == 'succeeded':
            return self.is_done and self.has_succeeded
        is_running = self.run is not None and self.run.code is None
        return is_running or (state is None and self.has_succeeded)

    @property
    def word(self) -> str:
        """Its state in a word: not started, running, restarting, succeeded, failed or ended."""
        if self.run is None:
            return 'failed' if self.is_done else 'not started'
        if self.run.code is None:
            return 'running'
        if self.is_leaving:
            return 'ended'
        if not self.is_done:
            return 'restarting'
        return 'succeeded' if self.has_succeeded else 'failed'

    @property
    def state(self) -> str:
        """Its state in words."""
        if self.run is None:
            return 'it has not been started'
        return 'it runs' if self.run.code is None else f'it {describe_end(self.run.code)}'

    def is_restarted(self, code: int) -> bool:
        """Return whether it is started again after it has ended with this code."""
        most = self.spec.most_restarts
        return self._may_restart(code) and (most is None or self.restarts < most)

    def describe_limit(self, code: int) -> str:
        """Return that it has used up its restarts; an empty string if that is not the reason."""
        most = self.spec.most_restarts
        if not (most and self._may_restart(code)):
            return ''
        return f', and was started again {"once" if most == 1 else f"{most} times"} already'

    def _may_restart(self, code: int) -> bool:
        restart = self.spec.restart
        return restart == 'always' or (restart == 'on_failure' and code != 0)


def describe_end(code: int) -> str:
    """Return how a process has ended, as in `has ended with exit code 1`.

    Args:
        code: The exit code, or a signal's number, negative.
    """
    if code >= 0:
        return f'has ended with exit code {code}'
    try:
        return f'was ended by {signal.Signals(-code).name}'
    except ValueError:
        return f'was ended by signal {-code}'
