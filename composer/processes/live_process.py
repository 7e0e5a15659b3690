"""A foreign process and its runs: how it is, how it has ended, and whether it is started again."""

from __future__ import annotations

import queue
import signal
import threading
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.language.specs import ProcessSpec

# A process that keeps dying is started again ever more slowly, as nodes are.
_FIRST_BACKOFF_SEC = 0.1
_LONGEST_BACKOFF_SEC = 30.0
_RECOVERED_SEC = 60.0
_MOST_FAILURES = 10


@dataclass(slots=True)
class ProcessRun:
    """One run of a process.

    Attributes:
        code: The exit code, or a signal's number, negative; `None` while it runs.
        answer: What the guardian said about its start.
        gone: Set when nothing of its process group is left.
        heard: Set when nothing holds its output open any more.
    """

    number: int
    process: LiveProcess
    heard: threading.Event
    code: int | None = None
    begun: float = field(default_factory=monotonic)
    answer: queue.SimpleQueue[dict[str, Any]] = field(default_factory=queue.SimpleQueue)
    gone: threading.Event = field(default_factory=threading.Event)
    was_killed: bool = False


@dataclass(slots=True)
class LiveProcess:
    """A process of the system.

    Attributes:
        run: The last one; `None` before the first.
        restarts: How often it was started again.
        failures: How many runs in a row were short.
        is_done: Whether it has ended, and is not started again.
    """

    spec: ProcessSpec
    run: ProcessRun | None = None
    restarts: int = 0
    failures: int = 0
    is_done: bool = False

    @property
    def is_ready(self) -> bool:
        """Whether it runs, or has ended well."""
        return self.run is not None and self.run.code in (None, 0)

    @property
    def state(self) -> str:
        """How it is, in words."""
        if self.run is None:
            return 'it has not been started'
        return 'it runs' if self.run.code is None else f'it {describe_end(self.run.code)}'


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


def is_restarted(process: LiveProcess, code: int) -> bool:
    """Return whether a process that has ended is started again."""
    spec = process.spec
    if spec.restart == 'never' or (spec.restart == 'on_failure' and code == 0):
        return False
    return spec.most_restarts is None or process.restarts < spec.most_restarts


def describe_limit(process: LiveProcess, code: int) -> str:
    """Return why a process is not started again, if that is for the number of times."""
    spec = process.spec
    if spec.restart == 'never' or (spec.restart == 'on_failure' and code == 0):
        return ''
    times = 'once' if spec.most_restarts == 1 else f'{spec.most_restarts} times'
    return f', and was started again {times} already' if spec.most_restarts else ''


def next_delay_sec(process: LiveProcess, lived_sec: float) -> float:
    """Return after how long a process is started again, and count its short runs."""
    if lived_sec > _RECOVERED_SEC:
        process.failures = 0
    backoff_sec = min(_FIRST_BACKOFF_SEC * 2.0**process.failures, _LONGEST_BACKOFF_SEC)
    process.failures = min(process.failures + 1, _MOST_FAILURES)
    return max(process.spec.restart_delay_sec, backoff_sec)
