"""Reports behaviours that run longer than `warn_after`, with their stacks.

One thread checks the running calls a few times in the shortest `warn_after` of the system; the
calls themselves only note when they began.
"""

from __future__ import annotations

from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Protocol

from composer.entity_kinds import ENTITY_KINDS
from composer.processes.backoff import Backoff
from composer.runtime.behaviours.running_calls import RunningCall
from composer.runtime.behaviours.waits import CODES_OF_ABSENCE
from composer.runtime.health.watcher import Watcher

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from composer.language.specs import SystemSpec
    from composer.runtime.behaviours.error_reports import ErrorReporter
    from composer.runtime.behaviours.running_calls import Owner, RunningCalls

_CHECKS_PER_LIMIT = 4
_SHORTEST_PAUSE_SEC = 0.01
_LONGEST_PAUSE_SEC = 1.0
# An entity that is slow again is not reported for this time, then for twice that, and so on.
_QUIET_SEC = 60.0
_LONGEST_QUIET_SEC = 3600.0


class HangLimit:
    """How long the behaviour of one entity may run; reports the calls that run longer.

    Args:
        place: Returns where the file declares it, as `file:line`.
        after_sec: `None` for no limit.
        warn: Takes the text, as the node's logger does.
    """

    def __init__(
        self,
        owner: Owner,
        place: Callable[[], str],
        after_sec: float | None,
        warn: Callable[[str], Any],
    ) -> None:
        self._owner = owner
        self.after_sec = after_sec
        self._place = place
        self._warn = warn
        self._quiet = Backoff(_QUIET_SEC, _LONGEST_QUIET_SEC, recovered_sec=float('inf'))
        self._quiet_until = float('-inf')
        self._skipped: set[int] = set()
        self._reported: dict[int, int] = {}
        # When a call was last seen to wait for what is not there yet: from then on it counts.
        self._absent_ns: dict[int, int] = {}

    def is_exceeded_by(self, call: RunningCall) -> bool:
        """Return whether a call has been running for too long."""
        ran_sec = (monotonic_ns() - call.since_ns) * 1e-9
        return self.after_sec is not None and ran_sec >= self.after_sec

    def check(self, running: RunningCalls, token: int, call: RunningCall) -> None:
        """Report a call that has been running for too long; each is reported once."""
        reported_ns = self._reported.get(token)
        if reported_ns is not None:
            if call.since_ns > reported_ns:
                self._report_end(token, 'went on', call.since_ns)
            return
        now_ns = monotonic_ns()
        if any(code in CODES_OF_ABSENCE for code in call.codes()):
            # What it waits for is logged instead.
            present = {key: ns for key, ns in self._absent_ns.items() if key in running.entries}
            self._absent_ns = {**present, token: now_ns}
            return
        since_ns = max(call.since_ns, self._absent_ns.get(token, 0))
        ran_sec = (now_ns - since_ns) * 1e-9
        if self.after_sec is None or ran_sec < self.after_sec:
            return
        if now_ns * 1e-9 < self._quiet_until:
            self._skipped.add(token)
            return
        self._skipped.discard(token)
        others = f' ({len(self._skipped)} others before it did so too)' if self._skipped else ''
        self._skipped.clear()
        self._quiet_until = now_ns * 1e-9 + self._quiet.next_delay_sec()
        self._reported[token] = since_ns
        self._warn(
            f'{self._owner} ({self._place()}) has been running for {ran_sec:.1f} s{others}; '
            f'it is at\n{call.format_stack()}'
        )
        running.on_end(token, lambda: self._report_end(token, 'returned', monotonic_ns()))

    def _report_end(self, token: int, what: str, now_ns: int) -> None:
        reported_ns = self._reported.pop(token, None)
        if reported_ns is not None:
            ran_sec = (now_ns - reported_ns) * 1e-9
            self._warn(f'{self._owner} ({self._place()}) {what} after {ran_sec:.1f} s')


class WatchedNode(Protocol):
    """What `HangWatcher` checks of a node.

    Attributes:
        limits: By the owners of the behaviours.
    """

    @property
    def running(self) -> RunningCalls: ...  # noqa: D102

    @property
    def limits(self) -> Mapping[Owner, HangLimit]: ...  # noqa: D102

    @property
    def errors(self) -> ErrorReporter: ...  # noqa: D102


class HangWatcher(Watcher):
    """The thread that checks the running calls.

    Args:
        nodes: By their full names.
        errors: Logs the errors outside all behaviours.
        beat: Called at each check: who waits for it in vain knows that no Python code runs.
    """

    def __init__(
        self,
        nodes: Mapping[str, WatchedNode],
        spec: SystemSpec,
        errors: ErrorReporter,
        beat: Callable[[], None],
    ) -> None:
        super().__init__('composer-watch', self._check_calls, _LONGEST_PAUSE_SEC)
        self._nodes = nodes
        self._errors = errors
        self._beat = beat
        self.follow(spec)

    def follow(self, spec: SystemSpec) -> None:
        """Check as often as the shortest `warn_after` of a system needs."""
        limits_sec = (limit for limit in _limits(spec) if limit is not None)
        shortest = min(limits_sec, default=float('inf'))
        pause_sec = max(shortest / _CHECKS_PER_LIMIT, _SHORTEST_PAUSE_SEC)
        self._pause_sec = min(pause_sec, _LONGEST_PAUSE_SEC)

    def overdue_calls(self) -> list[tuple[str, RunningCall]]:
        """Return the calls that exceed their `warn_after`, with their nodes' full names."""
        return [
            (full_name, call)
            for full_name, node in list(self._nodes.items())
            for call in node.running.calls()
            if (limit := node.limits.get(call.owner)) is not None and limit.is_exceeded_by(call)
        ]

    def running_calls(self) -> list[tuple[str, RunningCall]]:
        """Return the calls that run now, with their nodes' full names."""
        return [
            (full_name, call)
            for full_name, node in list(self._nodes.items())
            for call in node.running.calls()
        ]

    def _check_calls(self) -> None:
        self._beat()
        for node in list(self._nodes.values()):
            for token, entry in list(node.running.entries.items()):
                if entry is not None and (limit := node.limits.get(entry[0])) is not None:
                    limit.check(node.running, token, RunningCall(*entry))
            node.errors.flush_old()
        self._errors.flush_old()


def _limits(spec: SystemSpec) -> Iterator[float | None]:
    for node in spec.nodes.values():
        yield node.warn_after_sec
        for kind in ENTITY_KINDS:
            for entity in getattr(node, kind.section).values():
                yield getattr(entity, 'warn_after_sec', None)
