"""An edit of what runs in one process, step by step: all of it is made, or undone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.errors import ComposerError

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Collection

    from composer.planning.plan import Plan
    from composer.runtime.rewiring.rewire import Rewiring
    from composer.runtime.stop_request import StopRequest


class Edit:
    """What becomes of the nodes of this process, and of the external processes.

    Args:
        lock: Held from the first change until all are made or undone.
        on_commit: Called when all are made.
    """

    def __init__(
        self,
        plan: Plan,
        rewiring: Rewiring,
        lock: threading.Lock,
        stop: StopRequest,
        on_commit: Callable[[], None],
    ) -> None:
        self._plan = plan
        self._rewiring = rewiring
        self._lock = lock
        self._stop = stop
        self._on_commit = on_commit
        self._has_lock = False

    def wait_for_goals(self, aborts: Callable[[], bool], is_outdated: Callable[[], bool]) -> None:
        """Wait until no goal is in flight of an action that goes; see `Rewiring`."""
        self._rewiring.wait_for_goals(self._plan, aborts, is_outdated)

    def make_way(self, names: Collection[str]) -> None:
        """End those of these nodes that are here: they begin again in another process.

        It may be called several times.

        Args:
            names: Their full names.

        Raises:
            ComposerError: One of them hangs, or the system stops.
        """
        if not self._has_lock:
            self._lock.acquire()
            self._has_lock = True
        if self._stop.is_set:
            message = 'the system stops'
            raise ComposerError(message)
        self._rewiring.make_way(names)

    def apply(self, is_outdated: Callable[[], bool]) -> None:
        """Do all that the plan says; what may fail is done now.

        Raises:
            ComposerError: Something failed.
        """
        self._rewiring.apply(self._plan, is_outdated)

    def commit(self) -> None:
        """Let go of what was there before."""
        self._rewiring.commit()
        self._on_commit()
        self._release()

    def undo(self) -> None:
        """Be as before."""
        self._rewiring.undo()
        self._release()

    def _release(self) -> None:
        if self._has_lock:
            self._has_lock = False
            self._lock.release()
