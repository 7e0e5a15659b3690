"""Edits of a running system, in its workers; each step as in `composer.runtime.rewiring.edit`."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from composer.errors import ComposerError
from composer.processes.channel import ChannelLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from composer.planning.snapshot import Snapshot
    from composer.runtime.workers.assignment import Assignment
    from composer.runtime.workers.worker import Worker


class WorkerEdit(Protocol):
    """What becomes of one worker."""

    def wait_for_goals(self, aborts: Callable[[], bool], is_outdated: Callable[[], bool]) -> None:
        """Wait until no goal is in flight of an action that goes."""

    def make_way(self, names: Collection[str]) -> None:
        """End the nodes that begin elsewhere."""

    def apply(self, is_outdated: Callable[[], bool]) -> None:
        """Do all that may fail."""

    def commit(self) -> None:
        """Let go of what was there before."""

    def undo(self) -> None:
        """Be as before."""


class ChangedWorker:
    """A worker whose process goes on; one that is being started again does as the new files say.

    Args:
        assignment: What it is to run.
    """

    def __init__(self, worker: Worker, assignment: Assignment) -> None:
        self._worker = worker
        self._assignment = assignment
        self._is_alive = worker.is_alive and worker.is_up

    def wait_for_goals(
        self, _aborts: Callable[[], bool], _is_outdated: Callable[[], bool]
    ) -> None:
        """See `WorkerEdit`; the worker asks back."""
        self._call('begin_edit', self._assignment.snapshot)
        self._call('wait_for_goals')

    def make_way(self, names: Collection[str]) -> None:
        """See `WorkerEdit`."""
        self._call('make_way', names)

    def apply(self, _is_outdated: Callable[[], bool]) -> None:
        """See `WorkerEdit`."""
        worker = self._assignment.worker
        if worker != self._worker.spec:
            self._call('follow', worker)
        self._call('apply_edit')

    def commit(self) -> None:
        """See `WorkerEdit`."""
        with suppress(ComposerError):
            # One that has just gone is started again as the new files say.
            self._call('commit_edit')
        self._worker.assignment = self._assignment
        self._worker.spec = self._assignment.worker
        if self._worker.is_up:
            self._worker.keep_to_rules()

    def undo(self) -> None:
        """See `WorkerEdit`."""
        with suppress(ComposerError):
            self._call('undo_edit')
            if self._assignment.worker != self._worker.spec:
                self._call('follow', self._worker.spec)

    def _call(self, name: str, *arguments: object) -> None:
        if not self._is_alive:
            return
        try:
            self._worker.call(name, *arguments)
        except ChannelLostError:
            # It is started again as the files say then, unless it is this edit that ends it.
            self._is_alive = False
            if name == 'apply_edit':
                raise


class ReplacedWorker:
    """A worker that comes, goes, or needs another process.

    The old process is there until the new one has started: if that fails, its nodes begin there
    again, with their state.

    Args:
        old: The one that goes; `None` if it is new.
        new: The one that comes; `None` if it goes.
        adopt: Called with what there is instead of the old one, `None` for nothing.
    """

    def __init__(
        self,
        old: Worker | None,
        new: Worker | None,
        adopt: Callable[[Worker | None], None],
        timeout_sec: float,
    ) -> None:
        self._before = old
        # One that has ended needs no goodbye.
        self._old = old if old is not None and old.is_alive and old.is_up else None
        self._new = new
        self._adopt = adopt
        self._timeout_sec = timeout_sec

    def wait_for_goals(
        self, _aborts: Callable[[], bool], _is_outdated: Callable[[], bool]
    ) -> None:
        """See `WorkerEdit`; the worker asks back."""
        if self._old is not None and self._old.assignment is not None:
            self._old.call('begin_edit', without_nodes(self._old.assignment.snapshot))
            self._old.call('wait_for_goals')

    def make_way(self, names: Collection[str]) -> None:
        """See `WorkerEdit`."""
        if self._old is not None:
            self._old.call('make_way', names)

    def apply(self, _is_outdated: Callable[[], bool]) -> None:
        """See `WorkerEdit`."""
        if self._old is not None:
            self._old.call('apply_edit')
        if self._new is not None:
            self._new.start()

    def commit(self) -> None:
        """See `WorkerEdit`."""
        if self._before is not None:
            self._before.leave()
        self._adopt(self._new)
        if self._old is not None:
            with suppress(ComposerError):
                self._old.call('commit_edit')
            self._old.remove(self._timeout_sec)

    def undo(self) -> None:
        """See `WorkerEdit`."""
        if self._new is not None:
            self._new.remove(self._timeout_sec)
        if self._old is not None:
            with suppress(ComposerError):
                self._old.call('undo_edit')


def without_nodes(snapshot: Snapshot) -> Snapshot:
    """Return a part of a system without its nodes."""
    return replace(snapshot, spec=replace(snapshot.spec, nodes={}))
