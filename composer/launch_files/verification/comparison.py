"""Two lists of what processes were given → the pairs, and how they differ."""

from __future__ import annotations

from difflib import unified_diff
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.launch_files.verification.given import Given


@record
class Pair:
    """A process as the launch file starts it, and as the system does.

    Attributes:
        launched: `None` if only the system starts it.
        composed: `None` if only the launch file starts it.
    """

    launched: Given | None
    composed: Given | None

    @property
    def is_same(self) -> bool:
        """Whether both are given the same."""
        return self.launched == self.composed

    @property
    def label(self) -> str:
        """How the process is called in a report."""
        either = self.launched or self.composed
        return either.label if either else ''

    def difference(self) -> Iterator[str]:
        """Yield the lines that differ: `-` as the launch file, `+` as the system gives it."""
        if self.launched is None or self.composed is None:
            yield f'only {"composer up" if self.composed else "ros2 launch"} starts it'
            return
        before, after = list(self.launched.lines()), list(self.composed.lines())
        names = ('ros2 launch', 'composer up')
        diff = unified_diff(before, after, *names, lineterm='', n=0)
        yield from (line for line in diff if not line.startswith('@@'))


def pair(launched: list[Given], composed: list[Given]) -> list[Pair]:
    """Return the processes in pairs: those that are the same, then the most alike."""
    left, right = list(launched), list(composed)
    pairs = []
    for given in launched:
        if given in right:
            left.remove(given)
            right.remove(given)
            pairs.append(Pair(given, given))
    for given in left:
        best = max(right, key=lambda other: _likeness(given, other), default=None)
        if best is not None and best.program == given.program:
            right.remove(best)
            pairs.append(Pair(given, best))
        else:
            pairs.append(Pair(given, None))
    return [*pairs, *(Pair(None, each) for each in right)]


def _likeness(one: Given, other: Given) -> tuple[bool, int]:
    return one.program == other.program, len(set(one.lines()) & set(other.lines()))
