"""Monitor rate and age of a topic: `count` on a subscription, `watch` or `diagnose` on a timer.

```yaml
nodes:
  scan_monitor:
    publishers:
      scan_ok: std_msgs/msg/Bool
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        qos: sensor_data
        behaviour: behaviours.monitor:count
        with: {topic: scan}
    timers:
      watch_scan:
        period: 1.0
        behaviour: behaviours.monitor:watch
        with: {topic: scan, minimum_rate: 5.0, maximum_age: 0.5}
        publish: scan_ok
```
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Annotated, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer import Node

_OK, _WARN = b'\x00', b'\x01'


@dataclass(slots=True)
class _Counter:
    """The number of messages on a topic, and when the last one came."""

    messages: int
    last_ns: int


@dataclass(frozen=True, slots=True)
class _TopicHealth:
    """The health of a topic between two ticks; `problem` is empty if it is healthy."""

    rate: float
    age_sec: float
    problem: str


def count(node: Node, _message: Any, topic: str) -> None:
    """Count a message of `topic`, for `watch` or `diagnose` with the same `topic`.

    ```yaml
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        behaviour: behaviours.monitor:count
        with: {topic: scan}
    ```
    """
    counter = _counter(node, topic)
    counter.messages += 1
    counter.last_ns = node.now().nanoseconds


def watch(
    node: Node,
    topic: str,
    minimum_rate: Annotated[float, '>= 0'] = 0.0,
    maximum_age: Annotated[float, '> 0'] = inf,
) -> Iterator[bool | None]:
    """Yield at each tick whether a topic is healthy, and log when that changes.

    ```yaml
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        behaviour: behaviours.monitor:count
        with: {topic: scan}
    timers:
      watch_scan:
        period: 1.0
        behaviour: behaviours.monitor:watch
        with: {topic: scan, minimum_rate: 5.0, maximum_age: 0.5}
        publish: scan_ok  # std_msgs/msg/Bool
    ```

    Args:
        minimum_rate: The lowest healthy rate between two ticks, in Hz.
        maximum_age: The highest healthy age of the last message, in seconds.
    """
    for health in _monitor(node, topic, minimum_rate, maximum_age):
        yield None if health is None else not health.problem


def diagnose(
    node: Node,
    topic: str,
    minimum_rate: Annotated[float, '>= 0'] = 0.0,
    maximum_age: Annotated[float, '> 0'] = inf,
) -> Iterator[dict[str, Any] | None]:
    """Yield the health of a topic as diagnostics; otherwise as `watch`.

    ```yaml
    publishers:
      diagnostics: {type: diagnostic_msgs/msg/DiagnosticArray, topic: /diagnostics}
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        behaviour: behaviours.monitor:count
        with: {topic: scan}
    timers:
      watch_scan:
        period: 1.0
        behaviour: behaviours.monitor:diagnose
        with: {topic: scan, minimum_rate: 5.0}
        publish: diagnostics
    ```
    """
    for health in _monitor(node, topic, minimum_rate, maximum_age):
        yield None if health is None else _as_diagnostics(node, topic, health)


def _as_diagnostics(node: Node, topic: str, health: _TopicHealth) -> dict[str, Any]:
    values = {'rate (Hz)': health.rate, 'age (s)': health.age_sec}
    status = {
        'level': _WARN if health.problem else _OK,
        'name': f'{node.ros.get_fully_qualified_name()}: {topic}',
        'message': health.problem or 'OK',
        'values': [{'key': key, 'value': f'{value:.3g}'} for key, value in values.items()],
    }
    return {'header': {'stamp': node.now()}, 'status': [status]}


def _monitor(
    node: Node, topic: str, minimum_rate: float, maximum_age: float
) -> Iterator[_TopicHealth | None]:
    """Yield the health of a topic since the last tick; `None` at the first tick."""
    counter = _counter(node, topic)
    health: _TopicHealth | None = None
    while True:
        start_ns, start_count = node.now().nanoseconds, counter.messages
        yield health
        now_ns = node.now().nanoseconds
        # Simulated time may stand still or jump back.
        passed_sec = max(now_ns - start_ns, 1) / 1e9
        rate = (counter.messages - start_count) / passed_sec
        age_sec = max(now_ns - counter.last_ns, 0) / 1e9
        before = health.problem if health else ''
        health = _TopicHealth(
            rate, age_sec, _find_problem(rate, age_sec, minimum_rate, maximum_age)
        )
        if health.problem and not before:
            node.logger.warning(f'{topic}: {health.problem}')
        elif before and not health.problem:
            node.logger.info(f'{topic}: healthy again, {rate:.3g} messages/s')


def _find_problem(rate: float, age_sec: float, minimum_rate: float, maximum_age: float) -> str:
    if age_sec > maximum_age:
        return f'no message for {age_sec:.3g} s, at most {maximum_age:g} s expected'
    if rate < minimum_rate:
        return f'{rate:.3g} messages/s, at least {minimum_rate:g} expected'
    return ''


def _counter(node: Node, topic: str) -> _Counter:
    """Return the counter of a topic, shared by the behaviours of a node."""
    counters: dict[str, _Counter] = vars(node.state).setdefault('monitor_counters', {})
    return counters.setdefault(topic, _Counter(0, node.now().nanoseconds))
