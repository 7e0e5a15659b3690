"""Which of several systems of one name stays, however late or lost what they tell each other."""

import heapq
import random
from itertools import count, pairwise, permutations

import pytest

pytest.importorskip('rclpy')

from hypothesis import given, settings
from hypothesis import strategies as st

from composer.runtime.control.rivals import MOMENT_SEC, Standing

# The clock of each host is another one.
CLOCKS = (0.0, 1000.0, -50.0, 7.5)
LATEST_SEC = 100.0
SLACK_SEC = 1e-6


class Graph:
    """Rivals that find each other, and hear each other, after times by chance."""

    def __init__(self, begun, ids, seed):
        self.now = 0.0
        self._random = random.Random(seed)
        self._numbers = count()
        self._due = []
        self.rivals = [
            Standing(name, start + clock, lambda clock=clock: self.now + clock)
            for name, start, clock in zip(ids, begun, CLOCKS, strict=False)
        ]
        # What each told last, and who hears it.
        self._last = [None] * len(begun)
        self._heard_by = [set() for _ in begun]
        for mine, other in permutations(range(len(begun)), 2):
            both = max(begun[mine], begun[other])
            self._at(both + self._delay(), self._tell, mine)
            self._at(both + self._delay(), self._find, mine, other)

    def _delay(self):
        return self._random.choice([0.0, 0.001, 0.1, 0.3, 0.3, self._random.uniform(0.0, 4.0)])

    def _at(self, time, function, *arguments):
        heapq.heappush(self._due, (time, next(self._numbers), function, arguments))

    def _send(self, mine, other, claim):
        self._at(self.now + self._delay(), self._hear, other, claim)

    def _tell(self, mine):
        if not self.rivals[mine].gives_way:
            self._last[mine] = claim = self.rivals[mine].tell()
            for other in self._heard_by[mine]:
                self._send(mine, other, claim)

    def _find(self, mine, other):
        self._heard_by[mine].add(other)
        if self._last[mine] is not None:
            self._send(mine, other, self._last[mine])

    def _hear(self, mine, claim):
        if not self.rivals[mine].gives_way and self.rivals[mine].hear(claim):
            self._tell(mine)

    def run(self):
        """Return who is left when nobody says anything more."""
        while self._due:
            self.now, _, function, arguments = heapq.heappop(self._due)
            assert self.now < LATEST_SEC
            function(*arguments)
        return [index for index, each in enumerate(self.rivals) if not each.gives_way]


@given(
    begun=st.lists(st.integers(0, 30), min_size=2, max_size=4),
    ids=st.permutations('abcd'),
    seed=st.integers(0, 1_000_000),
)
@settings(max_examples=400)
def test_one_stays_and_it_is_the_oldest_where_that_is_clear(begun, ids, seed):
    starts = [each / 10 for each in begun]
    (left,) = Graph(starts, ids, seed).run()
    older = sorted(each for each in starts if each <= starts[left])
    # It began within a moment of the oldest, or of one that did, and so on.
    assert all(later - each < MOMENT_SEC + SLACK_SEC for each, later in pairwise(older))


@pytest.mark.parametrize(
    'claim',
    [{}, {'id': 'a'}, {'id': 'a', 'running_sec': 'long'}, {'id': 'a', 'running_sec': None}],
)
def test_what_is_no_claim_is_refused(claim):
    with pytest.raises((KeyError, TypeError, ValueError)):
        Standing('b', 0.0).hear(claim)


@pytest.mark.parametrize('running_sec', [float('nan'), 0.0])
def test_nobody_gives_way_to_itself_or_to_what_is_no_number(running_sec):
    standing = Standing('b', 0.0, lambda: 5.0)
    assert not standing.hear({'id': 'b', 'running_sec': running_sec})
    assert not standing.gives_way
