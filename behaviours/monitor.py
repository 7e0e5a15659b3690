"""Watches how often a topic is heard: `count` on a subscription, `watch` or `diagnose` on a timer.

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
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer import Node

_OK, _WARN = b'\x00', b'\x01'


@dataclass(slots=True)
class _Heard:
    """What has been heard of a topic: how many messages, and when the last one came."""

    messages: int
    last_ns: int


@dataclass(frozen=True, slots=True)
class _Verdict:
    """How a topic fared between two ticks; `fault` is empty if it fared well."""

    rate: float
    age_sec: float
    fault: str


def count(node: Node, _message: Any, topic: str) -> None:
    """Note that a message has been heard; `topic` is what the watch calls it.

    ```yaml
    subscriptions:
      scan:
        type: sensor_msgs/msg/LaserScan
        behaviour: behaviours.monitor:count
        with: {topic: scan}
    ```
    """
    heard = _heard(node, topic)
    heard.messages += 1
    heard.last_ns = node.now().nanoseconds


def watch(
    node: Node, topic: str, minimum_rate: float = 0.0, maximum_age: float = inf
) -> Iterator[bool | None]:
    """Say at each tick whether a topic is well, and log when that changes.

    ```yaml
    timers:
      watch_scan:
        period: 1.0
        behaviour: behaviours.monitor:watch
        with: {topic: scan, minimum_rate: 5.0, maximum_age: 0.5}
        publish: scan_ok  # std_msgs/msg/Bool
    ```

    Args:
        minimum_rate: The fewest messages a second, between two ticks.
        maximum_age: The most seconds since the last message.
    """
    for verdict in _judge(node, topic, minimum_rate, maximum_age):
        yield None if verdict is None else not verdict.fault


def diagnose(
    node: Node, topic: str, minimum_rate: float = 0.0, maximum_age: float = inf
) -> Iterator[dict[str, Any] | None]:
    """Do what `watch` does, and say it as diagnostics.

    ```yaml
    publishers:
      diagnostics: {type: diagnostic_msgs/msg/DiagnosticArray, topic: /diagnostics}
    timers:
      watch_scan:
        period: 1.0
        behaviour: behaviours.monitor:diagnose
        with: {topic: scan, minimum_rate: 5.0}
        publish: diagnostics
    ```
    """
    for verdict in _judge(node, topic, minimum_rate, maximum_age):
        yield None if verdict is None else _as_diagnostics(node, topic, verdict)


def _as_diagnostics(node: Node, topic: str, verdict: _Verdict) -> dict[str, Any]:
    values = {'rate (Hz)': verdict.rate, 'age (s)': verdict.age_sec}
    status = {
        'level': _WARN if verdict.fault else _OK,
        'name': f'{node.ros.get_fully_qualified_name()}: {topic}',
        'message': verdict.fault or 'OK',
        'values': [{'key': key, 'value': f'{value:.3g}'} for key, value in values.items()],
    }
    return {'header': {'stamp': node.now()}, 'status': [status]}


def _judge(
    node: Node, topic: str, minimum_rate: float, maximum_age: float
) -> Iterator[_Verdict | None]:
    """Yield how a topic fared since the tick before; the first tick begins the watch."""
    heard = _heard(node, topic)
    verdict: _Verdict | None = None
    while True:
        begun_ns, begun_with = node.now().nanoseconds, heard.messages
        yield verdict
        now_ns = node.now().nanoseconds
        # Simulated time may stand still, or begin again.
        passed_sec = max(now_ns - begun_ns, 1) / 1e9
        rate = (heard.messages - begun_with) / passed_sec
        age_sec = max(now_ns - heard.last_ns, 0) / 1e9
        before = verdict.fault if verdict else ''
        verdict = _Verdict(rate, age_sec, _find_fault(rate, age_sec, minimum_rate, maximum_age))
        if verdict.fault and not before:
            node.logger.warning(f'{topic}: {verdict.fault}')
        elif before and not verdict.fault:
            node.logger.info(f'{topic}: well again, {rate:.3g} messages a second')


def _find_fault(rate: float, age_sec: float, minimum_rate: float, maximum_age: float) -> str:
    if age_sec > maximum_age:
        return f'nothing heard for {age_sec:.3g} s, {maximum_age:g} s are allowed'
    if rate < minimum_rate:
        return f'{rate:.3g} messages a second, {minimum_rate:g} are expected'
    return ''


def _heard(node: Node, topic: str) -> _Heard:
    """Return what the behaviours of a node share about a topic; ages count from its first use."""
    heard: dict[str, _Heard] = vars(node.state).setdefault('heard_by_monitor', {})
    return heard.setdefault(topic, _Heard(0, node.now().nanoseconds))
