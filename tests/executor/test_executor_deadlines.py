"""Deadlines that are replaced while others are awaited."""

import select
import weakref
from time import monotonic_ns
from typing import Any

import pytest

pytest.importorskip('rclpy')

from spinning import DEADLINE_SEC

from composer.executor.deadlines import Deadlines

pytestmark = pytest.mark.ros
MS = 1_000_000
HOUR = 3_600_000 * MS


class Timed:
    """Says its name when it is due."""

    def __init__(self, name: str, due: list[str]) -> None:
        self.deadline_ns: int | None = None
        self._name = name
        self._due = due

    def on_deadline(self) -> None:
        self._due.append(self._name)


@pytest.fixture
def deadlines() -> Any:
    deadlines = Deadlines(lambda: None)
    yield deadlines
    deadlines.timer.close()


@pytest.mark.parametrize(
    'changes',
    [
        [('first', 10 * MS), ('second', 20 * MS), ('first', HOUR)],
        [('first', 10 * MS), ('second', 20 * MS), ('first', 30 * MS), ('first', HOUR)],
        [('first', HOUR), ('second', 20 * MS), ('first', 2 * HOUR)],
        [('second', 10 * MS), ('second', 20 * MS), ('first', HOUR), ('first', None)],
    ],
)
def test_what_is_postponed_does_not_keep_others_waiting(deadlines: Any, changes: Any) -> None:
    due: list[str] = []
    timed = {name: Timed(name, due) for name in ('first', 'second')}
    begun = monotonic_ns()
    for name, delay_ns in changes:
        deadlines.set(timed[name], None if delay_ns is None else begun + delay_ns)

    while not due:
        # Only when the kernel timer has expired does the executor look.
        assert select.select([deadlines.timer.fd], [], [], DEADLINE_SEC)[0], 'it did not expire'
        deadlines.run_due()
    assert due == ['second']
    assert monotonic_ns() >= begun + 20 * MS


def test_what_is_taken_back_is_not_kept(deadlines: Any) -> None:
    timed = Timed('first', [])
    deadlines.set(timed, monotonic_ns() + HOUR)
    deadlines.set(timed, monotonic_ns() + 2 * HOUR)
    deadlines.set(timed, None)
    kept = weakref.ref(timed)
    del timed
    assert kept() is None


def test_two_threads_may_follow_the_same_jump(deadlines: Any) -> None:
    class Jumped:
        """Clocks of which another thread takes the last one between a look and a take."""

        def __bool__(self) -> bool:
            return True

        def popleft(self) -> Any:
            raise IndexError

    deadlines.jumped = Jumped()
    deadlines.rearm_after_jumps()
