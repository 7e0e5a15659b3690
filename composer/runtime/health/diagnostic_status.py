"""Health of entities → `diagnostic_msgs/msg/DiagnosticStatus`, for ROS's diagnostic tools.

The name is `node: task`, as `diagnostic_updater` writes it, with the node's full name:
`/robot/talker: timer tick`. Viewers group by the slashes in it. The hardware is the system.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from composer.entity_kinds import KIND_OF_NOUN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.runtime.behaviours.running_calls import Owner
    from composer.runtime.costs.process_costs import ProcessCosts
    from composer.runtime.health.deliveries import Delivery
    from composer.runtime.health.statistics import EntityReport
    from composer.runtime.health.system_state import SystemState

_P99 = 0.99
_FEW_TICKS, _LATE_SHARE = 2, 0.1


class StatusWriter:
    """Writes the status of one entity again and again, always into the same message.

    Args:
        node: The full name of its node.
        owner: The entity.
        system: The system's name.
        worker: The worker that it runs in; empty for the process of the system.
    """

    def __init__(self, node: str, owner: Owner, system: str, worker: str = '') -> None:
        kind = KIND_OF_NOUN.get(owner.kind)
        self._missed = kind.missed if kind else {}
        self._values: dict[str, KeyValue] = {}
        self._status = DiagnosticStatus(name=_name(node, owner), hardware_id=system)
        if worker:
            self._set('worker', worker)

    def write(self, report: EntityReport) -> DiagnosticStatus:
        """Return the status; the message is the same one each time."""
        status = self._status
        status.level, status.message = summarize_report(report)
        times, calls = report.times, report.times.calls()
        self._set('calls', str(report.all_calls))
        self._set('errors', str(report.all_errors))
        self._set('rate (Hz)', f'{calls / report.period_sec:.2f}')
        if calls or not report.all_calls:
            self._set('callback time mean (ms)', f'{times.mean_ns() / 1e6:.4f}')
            self._set('callback time p99 (ms)', f'{times.percentile_ns(_P99) / 1e6:.4f}')
            self._set('callback time max (ms)', f'{times.most_ns / 1e6:.4f}')
        self._set_share('cpu (%)', report.cpu)
        for label, attribute in self._missed.items():
            self._set(label, str(getattr(report.all_missed, attribute)))
        return status

    def _set_share(self, key: str, share: float | None) -> None:
        """Set a share in percent; once it was known, it may be unknown again."""
        if share is not None or key in self._values:
            self._set(key, format_percent(share))

    def _set(self, key: str, value: str) -> None:
        pair = self._values.get(key)
        if pair is None:
            pair = self._values[key] = KeyValue(key=key)
            self._status.values.append(pair)
        pair.value = value


def format_percent(share: float | None) -> str:
    """Return a share in percent; empty if it is not known."""
    return '' if share is None else f'{share * 100:.2f}'


def summarize_report(report: EntityReport) -> tuple[bytes, str]:
    """Return the level of `DiagnosticStatus` that a report has, and why."""
    missed, overdue_sec = report.missed, report.overdue_sec
    problems = [
        _count(report.errors, 'error', f', last: {report.last_error}'),
        f'a call has been running for {overdue_sec:.1f} s' if overdue_sec else '',
        _count(missed.overruns, 'message', ' dropped from the full queue'),
        _count(missed.late_ticks, 'late tick'),
        _count(missed.skipped_ticks, 'skipped tick'),
    ]
    text = '; '.join(filter(None, problems))
    if report.errors:
        return DiagnosticStatus.ERROR, text
    # On a machine with load some ticks are always late; they stand in the values.
    is_late = missed.late_ticks > max(_FEW_TICKS, _LATE_SHARE * report.times.calls())
    if overdue_sec or missed.overruns or missed.skipped_ticks or is_late:
        return DiagnosticStatus.WARN, text
    return DiagnosticStatus.OK, 'called' if report.times.counts else 'not called'


def delivery_status(
    node: str, owner: Owner, delivery: Delivery, system: str, rate_hz: float | None
) -> DiagnosticStatus:
    """Return the status of a publisher or a client, which has no behaviour: its way and rate.

    Args:
        node: The full name of its node.
        system: The system's name.
    """
    values = {'delivery': delivery.way, 'delivery reason': delivery.reason}
    values |= {} if rate_hz is None else {'rate (Hz)': f'{rate_hz:.2f}'}
    return DiagnosticStatus(
        name=_name(node, owner),
        hardware_id=system,
        level=DiagnosticStatus.OK,
        message=str(delivery) or 'nobody listens',
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def lifecycle_status(node: str, state: str, system: str) -> DiagnosticStatus:
    """Return the status of a lifecycle: the state that it is in."""
    is_over = state == 'finalized'
    return DiagnosticStatus(
        name=f'{node}: lifecycle',
        hardware_id=system,
        level=DiagnosticStatus.WARN if is_over else DiagnosticStatus.OK,
        message=state,
        values=[KeyValue(key='state', value=state)],
    )


def process_status(node: str, process: Mapping[str, Any], system: str) -> DiagnosticStatus:
    """Return the status of an external process; see `describe_processes`.

    Args:
        node: The full name of the control node.
    """
    levels = {'warn': DiagnosticStatus.WARN, 'error': DiagnosticStatus.ERROR}
    values = {
        'state': process['state'],
        'pid': process['pid'],
        'restarts': process['restarts'],
        'cpu (%)': format_percent(process['cpu']),
        'memory (bytes)': process['memory_bytes'],
    }
    return DiagnosticStatus(
        name=f'{node}: process {process["name"]}',
        hardware_id=system,
        level=levels.get(process['level'], DiagnosticStatus.OK),
        message=process['message'] or process['state'],
        values=[
            KeyValue(key=key, value='' if value is None else str(value))
            for key, value in values.items()
        ],
    )


def _name(node: str, owner: Owner) -> str:
    task = str(owner).replace("'", '')
    return f'{node}: {task}'


def system_status(
    node: str, state: SystemState, costs: ProcessCosts | None = None
) -> DiagnosticStatus:
    """Return the status of a system itself.

    Args:
        node: The full name of its control node.
        costs: What its process costs, if that was measured.
    """
    last = state.last_reload
    values = {
        **{key: str(value) for key, value in state.who().items()},
        'state': state.word,
        'uptime (s)': f'{state.uptime_sec:.0f}',
        'last reload': '' if last is None else last.outcome.text,
        'last error': state.last_error,
        **({} if costs is None else _describe_costs(costs)),
    }
    problems = ['the last reload failed'] if state.last_error else []
    problems += [state.clock_problem] if state.clock_problem else []
    return DiagnosticStatus(
        name=f'{node}: system',
        hardware_id=state.name,
        level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
        message='; '.join([state.word, *problems]),
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )


def _describe_costs(costs: ProcessCosts) -> dict[str, str]:
    waits = costs.waits
    return {
        'cores': str(costs.cores),
        'cpu (%)': format_percent(costs.cpu),
        'GIL wait mean (ms)': '' if waits is None else f'{waits.mean_ms:.3f}',
        'GIL wait max (ms)': '' if waits is None else f'{waits.max_ms:.3f}',
    }


def _count(number: int, what: str, more: str = '') -> str:
    if not number:
        return ''
    return f'{number} {what}{"" if number == 1 else "s"}{more}'
