"""What a running system answers as JSON: its state, and the health of its entities."""

from __future__ import annotations

import json
import os
from itertools import chain
from typing import TYPE_CHECKING, Any

from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.control.protocol import VERSION
from composer.runtime.health.system_state import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from composer.planning.snapshot import Snapshot
    from composer.runtime.costs.process_costs import ProcessCosts
    from composer.runtime.health.call_times import CallTimes
    from composer.runtime.health.deliveries import Deliveries, Delivery
    from composer.runtime.health.diagnostics_publisher import DiagnosticsPublisher
    from composer.runtime.health.statistics import EntityKey, EntityReport
    from composer.runtime.health.system_state import SystemState

_LEVELS = ('ok', 'warn', 'error')
# What is wrong with a worker in this state.
_WORKER_STATES = {
    'ended': 'it has ended, and its nodes are gone',
    'restarting': 'it has ended, and is started again',
    'no answer': 'it does not answer',
}
_P50, _P99 = 0.5, 0.99
_NS_PER_MS = 1e6


def describe_status(
    state: SystemState,
    nodes: Sequence[str],
    components: Sequence[str],
    diagnostics: DiagnosticsPublisher | None,
) -> dict[str, Any]:
    """Return what a system, or a worker, says of itself.

    Args:
        nodes: Their full names.
        components: The full names of those that are loaded into containers.
        diagnostics: What measures the health of the entities; `None` if nothing does.
    """
    health = None if diagnostics is None else _summarize(diagnostics, state)
    names = {'nodes': list(nodes), 'components': list(components)}
    return {**state.document(), **names, 'health': health}


def status_answer(
    own: dict[str, Any], workers: Mapping[str, dict[str, Any]], states: Sequence[dict[str, Any]]
) -> Outcome:
    """Return what a system says of itself and of its workers.

    Args:
        own: What `describe_status` says of the process of the system.
        workers: What it says of each worker that answers.
        states: The state of each worker.
    """
    healths = [each['health'] for each in (own, *workers.values()) if each['health']]
    healths += [
        {'level': each['level'], 'message': f"process '{each['name']}': {each['message']}"}
        for each in own['external_processes']
        if each['message']
    ]
    healths += [
        {'level': _LEVELS[-1], 'message': f"worker '{each['name']}': {_WORKER_STATES[state]}"}
        for each in states
        if (state := each['state']) in _WORKER_STATES
    ]
    merged = {
        **{
            key: dict(chain(*(one[key].items() for one in (own, *workers.values()))))
            for key in ('lifecycles', 'awaited')
        },
        'health': max(healths, key=lambda each: _LEVELS.index(each['level']), default=None),
        'workers': list(states),
    }
    return _answer({**own, **merged})


def describe_top(
    state: SystemState,
    diagnostics: DiagnosticsPublisher,
    deliveries: Deliveries,
    foreign: Iterable[tuple[str, str, str]],
) -> dict[str, Any]:
    """Return the health of each entity in the last period, and have more measured in the next.

    Args:
        deliveries: Which way publishers and clients deliver, which have no figures but a rate.
        foreign: The node, noun and name of each end of other programs, which have no figures.
    """
    diagnostics.watch()
    latest = diagnostics.latest
    return {
        'name': state.name,
        'period': latest.number,
        'period_sec': diagnostics.period_sec,
        'has_cpu': latest.costs is not None,
        'external_processes': state.find_processes(),
        'processes': [] if latest.costs is None else [_describe_process(latest.costs)],
        'entities': [_describe_entity(key, report) for key, report in latest.by_entity.items()]
        + [_describe_delivery(key, each, latest.rates) for key, each in deliveries.items()]
        + [
            _describe_figureless((node, Owner('lifecycle', each)), None, '')
            for node, each in state.find_lifecycles().items()
        ]
        + [_describe_figureless((node, Owner(*end)), None, '') for node, *end in foreign],
    }


def top_answer(own: dict[str, Any] | None, workers: Mapping[str, dict[str, Any]]) -> Outcome:
    """Return the health of each entity, in the system's process and in its workers.

    Args:
        own: See `describe_top`; `None` if nothing is measured.
        workers: The same of each worker that answers.
    """
    if own is None:
        text = "the system measures nothing: its file says 'diagnostics: false'"
        return Outcome(succeeded=False, text=text)
    parts = {'': own, **workers}
    merged = {
        key: [{**each, 'worker': name} for name, part in parts.items() for each in part[key]]
        for key in ('processes', 'entities')
    }
    has_cpu = all(each['has_cpu'] for each in parts.values())
    return _answer({**own, 'has_cpu': has_cpu, **merged})


def snapshot_answer(snapshot: Snapshot, given: Mapping[str, list[str]]) -> Outcome:
    """Return what a system runs as, and the layers and arguments that it was given."""
    # Few ask, and workers start faster without it.
    from composer.planning.snapshot_data import encode_snapshot

    return _answer({**encode_snapshot(snapshot), 'given': given})


def _answer(data: dict[str, Any]) -> Outcome:
    return Outcome(succeeded=True, text=json.dumps({'version': VERSION, **data}))


def _summarize(diagnostics: DiagnosticsPublisher, state: SystemState) -> dict[str, str]:
    """Return the worst level of all entities, and the one that has it."""
    worst, message = int(bool(state.clock_problem)), state.clock_problem
    for (node, owner), report in diagnostics.latest.by_entity.items():
        level, text = _find_level(report)
        if level > worst:
            worst, message = level, f'{node}: {owner}: {text}'
    return {'level': _LEVELS[worst], 'message': message}


def _describe_entity(key: EntityKey, report: EntityReport) -> dict[str, Any]:
    node, owner = key
    times, missed = report.times, report.all_missed
    calls = times.calls()
    level, message = _find_level(report)
    return {
        'node': node,
        'kind': owner.kind,
        'name': owner.name,
        'key': owner.key,
        'level': _LEVELS[level],
        'message': message,
        'rate_hz': calls / report.period_sec,
        'mean_ms': times.mean_ns() / _NS_PER_MS if calls else None,
        'p50_ms': times.percentile_ns(_P50) / _NS_PER_MS if calls else None,
        'p99_ms': times.percentile_ns(_P99) / _NS_PER_MS if calls else None,
        'max_ms': times.most_ns / _NS_PER_MS if calls else None,
        **_delivery_times(report.deliveries),
        'cpu': report.cpu,
        'queued': report.queued,
        'calls': report.all_calls,
        'errors': report.all_errors,
        'dropped': missed.overruns,
        'late': missed.late_ticks,
        'skipped': missed.skipped_ticks,
        'delivery': None,
        'delivery_reason': '',
    }


def _delivery_times(deliveries: CallTimes | None) -> dict[str, float | None]:
    """Return how long messages were on their way, from the publisher to the callback."""
    if not (deliveries and deliveries.calls()):
        return {'delivery_p50_ms': None, 'delivery_p99_ms': None}
    return {
        'delivery_p50_ms': deliveries.percentile_ns(_P50) / _NS_PER_MS,
        'delivery_p99_ms': deliveries.percentile_ns(_P99) / _NS_PER_MS,
    }


def _describe_delivery(
    key: EntityKey, delivery: Delivery, rates: Mapping[EntityKey, float]
) -> dict[str, Any]:
    described = _describe_figureless(key, delivery.way, delivery.reason)
    return {**described, 'rate_hz': rates.get(key)}


def _describe_figureless(key: EntityKey, way: str | None, reason: str) -> dict[str, Any]:
    node, owner = key
    unknown = ('rate_hz', 'mean_ms', 'p50_ms', 'p99_ms', 'max_ms', 'cpu', 'queued')
    ways = ('delivery_p50_ms', 'delivery_p99_ms')
    none = ('calls', 'errors', 'dropped', 'late', 'skipped')
    return {
        'node': node,
        'kind': owner.kind,
        'name': owner.name,
        'key': owner.key,
        'level': _LEVELS[0],
        'message': '',
        **dict.fromkeys((*unknown, *ways)),
        **dict.fromkeys(none, 0),
        'delivery': way,
        'delivery_reason': reason,
    }


def _describe_process(costs: ProcessCosts) -> dict[str, Any]:
    """Return what a process costs as a whole."""
    waits = costs.waits
    return {
        'pid': os.getpid(),
        'cores': costs.cores,
        'cpu': costs.cpu,
        'gil_wait_mean_ms': None if waits is None else waits.mean_ms,
        'gil_wait_max_ms': None if waits is None else waits.max_ms,
    }


def _find_level(report: EntityReport) -> tuple[int, str]:
    # What is reported at all was measured for the messages of diagnostics.
    from composer.runtime.health.diagnostic_status import summarize_report

    level, message = summarize_report(report)
    return level[0], message
