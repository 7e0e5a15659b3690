"""What a running system would become: its files as they are saved, and not yet applied."""

from __future__ import annotations

import threading
from contextlib import suppress
from time import time_ns
from typing import TYPE_CHECKING, Any

from composer.application.plan import plan_from
from composer.application.system_reader import list_files
from composer.drawing.json_document import describe_finding
from composer.errors import ComposerError
from composer.planning.text import render_plan

if TYPE_CHECKING:
    from pathlib import Path

_MOST_LINES = 200


class SavedFiles:
    """Compares the files of a system with what runs, whenever one of them is saved.

    Attributes:
        next_plan: `lines`, as `composer plan` prints them, and `findings`; `None` if a reload
            would change nothing.
    """

    def __init__(self) -> None:
        self.next_plan: dict[str, Any] | None = None
        self._given: tuple[str, list[Path], list[str], list[str]] | None = None
        self._files: list[Path] = []
        self._times: dict[Path, int] = {}
        self._thread: threading.Thread | None = None

    def follow(
        self, running: str, paths: list[Path], words: list[str], set_values: list[str]
    ) -> None:
        """Compare from now on with what a system runs from; see `plan_from`."""
        self._given = running, paths, words, set_values
        self.next_plan, self._times = None, {}
        self._files = paths

    def look(self) -> None:
        """Plan anew, in a thread of its own, if a file was saved; soon `next_plan` is there."""
        if self._given is None or (self._thread and self._thread.is_alive()):
            return
        times = {each: _time_of(each) for each in self._files}
        if times != self._times:
            self._times = times
            name = 'composer-next-plan'
            self._thread = threading.Thread(
                target=self._plan, args=(self._given,), name=name, daemon=True
            )
            self._thread.start()

    def _plan(self, given: tuple[str, list[Path], list[str], list[str]]) -> None:
        lines: list[str] = []
        findings: list[Any] = []
        files, begun_ns = given[1], time_ns()
        try:
            plan, found, context = plan_from(*given)
            if context is not None:
                files = sorted(list_files(context))
            if plan is None:
                findings = [describe_finding(each) for each in found]
            elif plan.operations:
                lines = render_plan(plan).splitlines()[:_MOST_LINES]
        except (ComposerError, OSError) as error:
            # A file may go while it is read.
            lines = [str(error)]
        if self._given is given:
            # One that was saved meanwhile is looked at again.
            more = {each: _time_of(each) for each in files if each not in self._times}
            self._times |= {each: found for each, found in more.items() if found < begun_ns}
            self._files = files
            self.next_plan = {'lines': lines, 'findings': findings} if lines or findings else None


def _time_of(path: Path) -> int:
    with suppress(OSError):
        return path.stat().st_mtime_ns
    return 0
