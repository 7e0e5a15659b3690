"""What subscriptions and timers miss because callbacks take too long."""

from typing import Any

from rclpy.qos import HistoryPolicy, QoSProfile
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from composer.executor.sources.inbox import Inbox
from composer.records import record
from composer.runtime.costs.call_meter import call_meter
from composer.runtime.health.call_times import CallTimes
from composer.runtime.health.watched_clocks import WallClock
from composer.runtime.tracing.tracer import tracer

_LATE_SHARE = 0.1
_MIN_LATE_NS = 1_000_000
# To time a message costs as much as a tenth of its delivery.
_TIMINGS, _MOST_TIMED = 25, 1000


@record
class MissedCounts:
    """What an entity missed because callbacks took too long, since it is counted.

    Attributes:
        overruns: Messages that the middleware dropped from the queue of a subscription, because
            newer ones came before they were taken. Not those lost on the way to the queue.
        late_ticks: Ticks of a timer that began late.
        skipped_ticks: Ticks that never began: rcl skips those whose time has passed.
    """

    overruns: int = 0
    late_ticks: int = 0
    skipped_ticks: int = 0

    def __add__(self, other: 'MissedCounts') -> 'MissedCounts':
        return MissedCounts(
            self.overruns + other.overruns,
            self.late_ticks + other.late_ticks,
            self.skipped_ticks + other.skipped_ticks,
        )

    def __sub__(self, other: 'MissedCounts') -> 'MissedCounts':
        return MissedCounts(
            self.overruns - other.overruns,
            self.late_ticks - other.late_ticks,
            self.skipped_ticks - other.skipped_ticks,
        )

    def __bool__(self) -> bool:
        return self != MissedCounts()


class MissedNothing:
    """Counts what an entity misses: by itself, none.

    Attributes:
        node: The full name of the entity's node.
        what: What a trace calls the entity.
        deliveries: How long messages were on their way, from their publishers to the callback,
            while somebody looks; `None` of what gets none.
    """

    node = what = ''
    deliveries: CallTimes | None = None

    def __call__(self) -> MissedCounts:
        """Return what it has missed."""
        return MissedCounts()

    def queued(self) -> int:
        """Return how many messages wait for it."""
        return 0


def count_missed(
    executor: Any, node: Any, entity: Any, inbox: Inbox | None = None, what: str = ''
) -> MissedNothing:
    """Begin to count what an entity of `node` misses in `executor`; returns what tells it.

    Args:
        inbox: The queue of a subscription for what does not come through the middleware.
        what: What a trace calls the entity.
    """
    counter: MissedNothing
    if isinstance(entity, Subscription):
        counter = QueueOverruns(entity.qos_profile, inbox)
    elif isinstance(entity, Timer):
        counter = MissedTicks()
    else:
        return MissedNothing()
    counter.what = what
    executor.observe(node, entity, counter)
    return counter


class MissedTicks(MissedNothing):
    """Counts the late and skipped ticks of a timer.

    A tick is late if it begins more than a tenth of its period, and more than 1 ms, after its
    time. A thread that computes lets go of the interpreter once in `sys.getswitchinterval()`, 1 ms
    while the executor spins: beside it, timers with periods below 10 ms are late indeed.
    """

    def __init__(self) -> None:
        self._late = 0
        self._skipped = 0
        self._wall_clock = WallClock()

    def __call__(self) -> MissedCounts:
        """Return what it has missed."""
        return MissedCounts(late_ticks=self._late, skipped_ticks=self._skipped)

    def on_tick(self, late_ns: int, next_ns: int, period_ns: int) -> None:
        """Note a tick that began `late_ns` after its time; the next is `next_ns` after its."""
        if self._wall_clock.find_step_ns():
            # It is late by the step.
            return
        if late_ns > _MIN_LATE_NS and late_ns > _LATE_SHARE * period_ns:
            self._late += 1
            if tracer.is_on:
                tracer.note('late', self.node, self.what, late_ns)
        # rcl sets the next tick to the next multiple of the period that has not passed.
        self._skipped += max(0, next_ns // period_ns - 1)


class QueueOverruns(MissedNothing):
    """Counts the messages that were pushed out of the queue of a subscription.

    If fewer messages can be taken than came, newer ones have pushed the others out of the queue.
    `_taken` counts a take from before it begins until it finds nothing: so one under way in
    another thread, as in reentrant groups, does not count as an overrun.
    """

    def __init__(self, profile: QoSProfile, inbox: Inbox | None = None) -> None:
        self._inbox = inbox
        # Of a queue without an end, nothing is known before it runs empty.
        self._depth = profile.depth if profile.history == HistoryPolicy.KEEP_LAST else 0
        self._arrived = 0
        self._taken = 0
        self._overruns = 0
        self._is_counting = True
        self.timings = 0
        self.deliveries = deliveries = CallTimes(has_cpu=False)
        self.note_delivery = deliveries.add

    def __call__(self) -> MissedCounts:
        """Return what it has missed."""
        self._begin_timings()
        if self._depth:
            # A queue that never runs empty: the middleware holds no more than its depth.
            self._note_overruns(self._arrived - self._taken - self._depth)
        local = 0 if self._inbox is None else self._inbox.overruns
        return MissedCounts(overruns=self._overruns + local)

    def _begin_timings(self) -> None:
        """Have some messages of the next period timed, if somebody looks."""
        self.timings = _TIMINGS if call_meter.is_on else 0
        if self._inbox is not None:
            self._inbox.timings = self.timings
            # Those that were pushed out are never taken.
            if len(self._inbox.put_ns) > _MOST_TIMED:
                self._inbox.put_ns.clear()

    def queued(self) -> int:
        """Return how many messages wait to be taken, as far as that is known."""
        waiting = self._arrived - self._taken - self._overruns if self._is_counting else 0
        local = 0 if self._inbox is None else len(self._inbox.messages)
        return local + max(0, min(waiting, self._depth or waiting))

    def on_announced(self, count: int | None) -> None:
        """Note that `count` messages came; None: nobody knows how many."""
        if count is None:
            self._is_counting = False
        else:
            self._arrived += count
            if tracer.is_on:
                tracer.note('queue', self.node, self.what, self.queued())

    def begin_take(self) -> int:
        """Note that a take begins; returns how many had come until then."""
        self._taken += 1
        return self._arrived

    def note_nothing_taken(self, arrived: int) -> None:
        """Note that nothing was left when the take began of which `begin_take` told that."""
        self._taken -= 1
        if self._is_counting:
            self._note_overruns(arrived - self._taken)
        else:
            self._arrived = self._taken + self._overruns
            self._is_counting = True

    def _note_overruns(self, count: int) -> None:
        # A message may be taken right before its event comes, which makes one count too low.
        if count > self._overruns:
            if tracer.is_on:
                tracer.note('dropped', self.node, self.what, count - self._overruns)
            self._overruns = count
