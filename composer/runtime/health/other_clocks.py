"""Compares the clock of this host with those of the other hosts of the system, while it runs.

Each part answers with its time on a service of its control node, and asks the others: as soon as
they are there, and from time to time, since clocks are set, and hosts come back after a boot.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType

from composer.network.clock_skew import (
    MOST_SKEW_SEC,
    TRIPS,
    ClockTrip,
    describe_skew,
    find_skew,
)
from composer.runtime.control import protocol
from composer.runtime.health.other_hosts import find_other_hosts
from composer.runtime.health.system_state import ClockSkew
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.client import Client
    from rclpy.node import Node as RosNode

    from composer.language.specs import SystemSpec
    from composer.runtime.health.system_state import SystemState

_LOOK_SEC = 1.0
_COMPARE_SEC = 60.0


class OtherClocks:
    """Answers with the time of this host, and asks the parts on other hosts for theirs.

    Args:
        node: The control node.
        spec: The part of this host.
        state: Is told how far the clocks are off.
        now_ns: The clock of this host.
    """

    def __init__(
        self,
        node: RosNode,
        spec: SystemSpec,
        state: SystemState,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        from std_srvs.srv import Trigger

        group = MutuallyExclusiveCallbackGroup()

        def find(host: str) -> _Other:
            # Relative, as all parts have the namespace of the command line.
            service = f'{protocol.node_name(f"{spec.name}@{host}")}/{protocol.CLOCK}'
            client = node.create_client(Trigger, service, callback_group=group)
            return _Other(host, spec.host or '', client, state, now_ns)

        self._now_ns = now_ns
        self._others = [find(host) for host in find_other_hosts(spec)]
        node.create_service(Trigger, f'~/{protocol.CLOCK}', self._answer, callback_group=group)
        # A clock of its own, as that of the node may be the time of a simulation.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(_LOOK_SEC, self._look, callback_group=group, clock=steady)

    def _answer(self, _request: Any, response: Any) -> Any:
        response.success, response.message = True, str(self._now_ns())
        return response

    def _look(self) -> None:
        for each in self._others:
            each.look()


class _Other:
    """The clock of one other host."""

    def __init__(
        self, name: str, here: str, client: Client, state: SystemState, now_ns: Callable[[], int]
    ) -> None:
        self._name, self._here, self._client = name, here, client
        self._state, self._now_ns = state, now_ns
        self._due = 0.0
        self._trips: list[ClockTrip] = []
        self._asked: Any = None
        # What was told last; 0 for a clock that is right.
        self._told_sec = 0.0

    def look(self) -> None:
        """Ask for the time if that is due."""
        if not self._client.service_is_ready():
            self._due = 0.0
        elif time.monotonic() >= self._due:
            self._due = time.monotonic() + _COMPARE_SEC
            self._trips.clear()
            self._ask()

    def _ask(self) -> None:
        if self._asked is not None:
            # Of one that has not answered, nothing is left.
            self._client.remove_pending_request(self._asked)
        sent_ns, begun = self._now_ns(), time.monotonic()
        self._asked = self._client.call_async(self._client.srv_type.Request())
        self._asked.add_done_callback(partial(self._take, sent_ns, begun))

    def _take(self, sent_ns: int, begun: float, answer: Any) -> None:
        trip_sec = time.monotonic() - begun
        self._asked = None
        response = answer.result()
        if response is None or not response.message.isdecimal():
            return  # It was given up, or somebody else answers there.
        self._trips.append(ClockTrip(sent_ns, int(response.message), trip_sec))
        if len(self._trips) < TRIPS:
            self._ask()
        else:
            self._tell(*find_skew(self._trips))

    def _tell(self, skew_sec: float, error_sec: float) -> None:
        problem = describe_skew(self._name, skew_sec, error_sec, self._here)
        self._state.clocks[self._name] = ClockSkew(skew_sec, is_off=problem is not None)
        if problem is None:
            if self._told_sec:
                system_logger.info(f'the clock of host {self._name} is right again')
            self._told_sec = 0.0
        elif abs(skew_sec - self._told_sec) > MOST_SKEW_SEC + error_sec:
            self._told_sec = skew_sec
            system_logger.warning(problem)
