"""What a running system would become: its files as they are saved, and not yet applied."""

from __future__ import annotations

from threading import Thread
from typing import TYPE_CHECKING, Any

from composer.application.plan import plan_from
from composer.application.system_reader import list_files
from composer.application.watched_files import WatchedFiles
from composer.drawing.json_document import describe_finding
from composer.errors import ComposerError
from composer.planning.text import render_plan

if TYPE_CHECKING:
    from pathlib import Path

_MOST_LINES = 200


class SavedFiles:
    """Compares the files of a system with what runs, whenever one of them is saved.

    Args:
        running: What it runs from; for the others, too, see `plan_from`.

    Attributes:
        next_plan: `lines`, as `composer plan` prints them, and `findings`; `None` if a reload
            would change nothing.
    """

    def __init__(
        self, running: str, paths: list[Path], words: list[str], set_values: list[str]
    ) -> None:
        self.next_plan: dict[str, Any] | None = None
        self._given = running, paths, words, set_values
        # None has been read so far.
        self._files = WatchedFiles(paths, begun_ns=0)
        self._thread: Thread | None = None

    def look(self) -> None:
        """Plan anew, in a thread of its own, if a file was saved; soon `next_plan` is there."""
        if (self._thread and self._thread.is_alive()) or not self._files.list_changed():
            return
        self._files.note_reading()
        self._thread = Thread(target=self._plan, name='composer-next-plan', daemon=True)
        self._thread.start()

    def _plan(self) -> None:
        lines: list[str] = []
        findings: list[Any] = []
        try:
            plan, found, context = plan_from(*self._given)
            if context is not None:
                self._files.follow(list_files(context))
            if plan is None:
                findings = [describe_finding(each) for each in found]
            elif plan.operations:
                lines = render_plan(plan).splitlines()[:_MOST_LINES]
        except (ComposerError, OSError) as error:
            # A file may go while it is read.
            lines = [str(error)]
        self.next_plan = {'lines': lines, 'findings': findings} if lines or findings else None
