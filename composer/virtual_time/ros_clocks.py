"""ROS's clocks in virtual time.

All nodes have one clock, of ROS time, that is overridden with the virtual time: rcl computes the
timers' deadlines from it. What follows `/clock` otherwise, with `use_sim_time`, has it, too. Other
clocks read the time in C; they are asked here instead.
"""

from __future__ import annotations

from contextlib import ExitStack, contextmanager, suppress
from copy import copy
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakSet

import rclpy.node
import rclpy.timer
from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time

from composer.virtual_time.clocks import MONOTONIC_START_NS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.virtual_time.simulated_threads import SimulatedThreads

# How long at most a plain executor does not look.
_STEP_NS: Final = 10_000_000
_WAITED_FOR: Final = ('subscription', 'guard_condition', 'timer', 'client', 'service')


class SimulatedClock(ROSClock):
    """The clock of all nodes; only virtual time sets it."""

    start_ns: int
    threads: SimulatedThreads

    def now(self) -> Time:
        """Return the virtual time."""
        thread = self.threads.mine()
        if thread is not None:
            self.threads.count_look(thread)
        now_ns = self.start_ns + self.threads.read_ns(_key(self))
        return Time(nanoseconds=now_ns, clock_type=ClockType.ROS_TIME)

    def set_ros_time_override(self, time: Time) -> None:
        """Do nothing: who publishes `/clock` does not set it."""

    def _set_ros_time_is_active(self, _enabled: bool) -> None:  # noqa: FBT001 - rclpy's
        """Do nothing: it is always simulated."""

    def advance(self, now_ns: int) -> None:
        """Let rcl know the virtual time."""
        time = Time(nanoseconds=self.start_ns + now_ns, clock_type=ClockType.ROS_TIME)
        super().set_ros_time_override(time)


@contextmanager
def simulated_clocks(threads: SimulatedThreads, start_time_ns: int) -> Iterator[SimulatedClock]:
    """Let rclpy's clocks show virtual time to simulated threads, and move its timers, meanwhile.

    Args:
        start_time_ns: What they show at the virtual time 0, in ns since 1970.
    """
    clock: Any = ROSClock()
    clock.__class__ = SimulatedClock
    clock.start_ns, clock.threads = start_time_ns, threads
    clock.advance(threads.now_ns)
    ROSClock._set_ros_time_is_active(clock, True)  # noqa: SLF001 - rclpy's
    threads.on_advance = clock.advance
    with ExitStack() as stack:
        for owner, name, value in _replacements(threads, clock):
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)
        yield clock


def _replacements(
    threads: SimulatedThreads, simulated: SimulatedClock
) -> Iterator[tuple[Any, str, Callable[..., Any]]]:
    now, sleep_until = Clock.now, Clock.sleep_until
    create_timer = rclpy.timer.Timer.__init__

    def create_ros_clock() -> Any:
        return ROSClock() if threads.mine() is None else simulated

    def now_virtually(self: Any) -> Time:
        thread = threads.mine()
        if thread is None or getattr(self, 'ros_time_is_active', False):
            return now(self)
        threads.count_look(thread)
        is_steady = self.clock_type is ClockType.STEADY_TIME
        start_ns = MONOTONIC_START_NS if is_steady else simulated.start_ns
        now_ns = start_ns + threads.read_ns(_key(self))
        return Time(nanoseconds=now_ns, clock_type=self.clock_type)

    def sleep_virtually(self: Any, until: Time, context: Any = None) -> bool:
        if threads.mine() is None:
            return bool(sleep_until(self, until, context))
        now: Time = self.now()
        # As long as is asked for: the clock has shown a nanosecond more.
        left_ns = until.nanoseconds - now.nanoseconds + threads.ahead_ns(_key(self))
        if left_ns > 0:
            threads.sleep(left_ns)
        return True

    def create_timer_on(
        self: Any, callback: Any, group: Any, period_ns: int, clock: Any, **options: Any
    ) -> None:
        used = clock if threads.mine() is None else simulated
        create_timer(self, callback, group, period_ns, used, **options)

    yield from _ends(threads)
    wait_set: Any = _rclpy.WaitSet
    yield wait_set, 'wait', _waits_in_steps(threads, wait_set.wait)
    yield rclpy.node, 'ROSClock', create_ros_clock
    yield Clock, 'now', now_virtually
    yield Clock, 'sleep_until', sleep_virtually
    yield rclpy.timer.Timer, '__init__', create_timer_on


def _key(clock: Any) -> str:
    """Return what `SimulatedThreads` knows a clock by."""
    return str(clock.clock_type.name)


def _waits_in_steps(threads: SimulatedThreads, wait: Any) -> Callable[..., None]:
    """Return what a plain executor of a behaviour waits with, again and again."""

    def wait_in_steps(self: Any, timeout_ns: Any) -> None:
        if threads.mine() is None or timeout_ns == 0:
            wait(self, timeout_ns)
            return
        wait(self, 0)
        # It forgets what is not ready. Those who use it make a new one when nothing is.
        if not any(map(self.get_ready_entities, _WAITED_FOR)):
            threads.sleep(_STEP_NS if timeout_ns < 0 else min(timeout_ns, _STEP_NS))

    return wait_in_steps


# How long the middleware may take, in real time, to bring what is latched.
_LATCHED_SEC: Final = 10.0
# The place of the QoS among the arguments of rclpy's methods, after the node.
_QOS_PLACES: Final = {'create_publisher': 2, 'create_subscription': 3}


def _ends(threads: SimulatedThreads) -> Iterator[tuple[Any, str, Callable[..., Any]]]:
    """Yield what makes publishers and subscriptions that the middleware keeps no real time for.

    A late subscription has at once what its publishers keep for it, which a thread of the
    middleware brings; and no message grows too old.
    """
    latched: WeakSet[Publisher] = WeakSet()

    def creating(create: Callable[..., Any], place: int) -> Callable[..., Any]:
        def create_end(self: Any, *arguments: Any, **options: Any) -> Any:
            if threads.mine() is None:
                return create(self, *arguments, **options)
            if 'qos_profile' in options:
                options['qos_profile'] = _without_lifespan(options['qos_profile'])
            elif len(arguments) > place:
                given = list(arguments)
                given[place] = _without_lifespan(given[place])
                arguments = tuple(given)
            end = create(self, *arguments, **options)
            if end.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                if isinstance(end, Publisher):
                    latched.add(end)
                else:
                    _await_latched(threads, latched, end)
            return end

        return create_end

    for name, place in _QOS_PLACES.items():
        yield rclpy.node.Node, name, creating(getattr(rclpy.node.Node, name), place)


def _await_latched(
    threads: SimulatedThreads, latched: WeakSet[Publisher], subscription: Any
) -> None:
    """Wait until a subscription has what the publishers of its topic keep for it."""
    # Sets are in the order of addresses, but who is waited for first makes no difference.
    for publisher in list(latched):
        with suppress(InvalidHandle, _rclpy.RCLError), threads.outside():
            if publisher.topic_name == subscription.topic_name:
                publisher.wait_for_all_acked(Duration(seconds=_LATCHED_SEC))


def _without_lifespan(qos: Any) -> Any:
    if not isinstance(qos, QoSProfile) or not qos.lifespan.nanoseconds:
        return qos
    endless = copy(qos)
    endless.lifespan = Duration()
    return endless
