"""Watches what timers follow: the wall clock may be set, and `/clock` may have no publisher.

The timers of a ROS clock are those of the wall clock without `use_sim_time`. rcl learns nothing of
its steps: when it is set back, a timer stands still until the clock is where it was.
"""

from __future__ import annotations

from contextlib import suppress
from time import monotonic, monotonic_ns, time_ns
from typing import TYPE_CHECKING

from rclpy.exceptions import InvalidHandle

from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rclpy.node import Node as RosNode

    from composer.runtime.health.system_state import SystemState

# NTP slews smaller differences away.
_LEAST_STEP_NS = 50_000_000
# A thread that pauses for longer between two clocks compares nothing.
_PROMPT_NS = 1_000_000
# Simulators take their time to start.
_PATIENCE_SEC = 7.0


class WallClock:
    """The wall clock, compared with the steady one."""

    def __init__(self) -> None:
        self._ahead_ns: int | None = None
        self.find_step_ns()

    def find_step_ns(self) -> int:
        """Return by how much it was set since the last call; 0 if it was not."""
        began_ns = monotonic_ns()
        ahead_ns = time_ns() - began_ns
        if monotonic_ns() - began_ns > _PROMPT_NS:
            return 0
        before_ns, self._ahead_ns = self._ahead_ns, ahead_ns
        step_ns = 0 if before_ns is None else ahead_ns - before_ns
        return step_ns if abs(step_ns) >= _LEAST_STEP_NS else 0


class Clocks:
    """The clocks of the nodes of one process.

    Args:
        find_nodes: Returns these nodes.
        state: Is told whether `/clock` has no publisher.
        tells_steps: Whether to log steps of the wall clock: one process of the system does.
    """

    def __init__(
        self,
        find_nodes: Callable[[], list[RosNode]],
        state: SystemState,
        *,
        tells_steps: bool,
    ) -> None:
        self._find_nodes = find_nodes
        self._state = state
        self._tells_steps = tells_steps
        self._wall_clock = WallClock()
        # The topics that nobody publishes, since when, and whether that was told.
        self._missing: dict[str, tuple[float, bool]] = {}

    def check(self, node: RosNode) -> None:
        """Look at all of them."""
        nodes = self._find_nodes()
        if step_ns := self._wall_clock.find_step_ns():
            if self._tells_steps:
                way = 'back' if step_ns < 0 else 'forward'
                text = f'the wall clock was set {way} by {abs(step_ns) * 1e-9:.1f} s'
                system_logger.warning(text)
            _release_timers(nodes)
        self._check_simulated_time(node, nodes)

    def _check_simulated_time(self, asked: RosNode, nodes: Iterable[RosNode]) -> None:
        """Tell which topics of simulated time have had no publisher for a while."""
        waiting: dict[str, list[str]] = {}
        for node in nodes:
            if node.get_parameter('use_sim_time').value:
                topic = node.resolve_topic_name('/clock')
                waiting.setdefault(topic, []).append(node.get_fully_qualified_name())
        missing, now = {}, monotonic()
        for topic, names in waiting.items():
            if asked.count_publishers(topic):
                continue
            since, is_told = self._missing.get(topic, (now, False))
            is_late = now - since >= _PATIENCE_SEC
            missing[topic] = since, is_late
            if is_late and not is_told:
                more = f' and {len(names) - 1} more' if names[1:] else ''
                system_logger.warning(
                    f"nobody publishes '{topic}': with 'use_sim_time', the clock and the timers "
                    f"of node '{min(names)}'{more} stand still"
                )
        self._missing = missing
        late = ', '.join(f"'{topic}'" for topic, (_, is_late) in missing.items() if is_late)
        self._state.clock_problem = late and f'nobody publishes {late}'


def _release_timers(nodes: Iterable[RosNode]) -> None:
    """Begin a period now of the timers that stand still for longer than one."""
    for node in nodes:
        for timer in list(node.timers):
            # A behaviour may destroy it meanwhile.
            with suppress(InvalidHandle):
                until_ns = timer.time_until_next_call()
                if until_ns is not None and until_ns > timer.timer_period_ns:
                    timer.reset()
