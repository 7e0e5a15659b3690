"""The figures of entities over some time, from what a running system or a recording says."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.errors import ComposerError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

# Node, kind, name and key of an entity.
_Task: TypeAlias = 'tuple[str, str, str, str]'

DIAGNOSTICS = '/diagnostics'
_TASK = re.compile(r'(?P<node>/[^:]*): (?P<kind>[a-z_ ]+?)(?: (?P<name>[^ ()]+))?(?: \(.*\))?')
_PERCENT = 100.0
_LOST = ('queue overruns',)


@record
class EntityFigures:
    """What was measured of an entity.

    Attributes:
        node: The full name of its node.
        cpu: How many processors its calls used on average.
        rate_hz: Calls in a second.
        lost_hz: Messages that were dropped from its queue in a second.
        worker: Where it ran; empty for the process of the system.
    """

    node: str
    kind: str
    name: str
    cpu: float
    rate_hz: float
    lost_hz: float = 0.0
    worker: str = ''


@record
class Measured:
    """What was measured of a system.

    Attributes:
        entities: Those with figures.
        cores: How many processor cores it may use there; `None` if that was not told.
        sizes: The mean size of messages in bytes, by the full names of topics, where it is known.
        others: How many of the cores other programs used; 0 if that is not known.
    """

    entities: tuple[EntityFigures, ...]
    cores: int | None
    sizes: Mapping[str, float]
    others: float = 0.0


class Averages:
    """Takes the figures of one period after the other."""

    def __init__(self) -> None:
        self._sums: dict[_Task, list[float]] = {}
        self._workers: dict[_Task, str] = {}

    def add(self, task: _Task, cpu: float, rate_hz: float, lost_hz: float, worker: str) -> None:
        """Take figures of an entity.

        Args:
            task: Node, kind, name and key of the entity.
            worker: Where it ran.
        """
        self._workers[task] = worker
        sums = self._sums.setdefault(task, [0.0] * 4)
        for index, value in enumerate((cpu, rate_hz, lost_hz, 1.0)):
            sums[index] += value

    def entities(self) -> tuple[EntityFigures, ...]:
        """Return the averages, in the order of names; what an entity has several of is one."""
        return tuple(
            EntityFigures(
                *task[:3],
                cpu=sums[0] / sums[3],
                rate_hz=sums[1] / sums[3],
                lost_hz=sums[2] / sums[3],
                worker=self._workers[task],
            )
            for task, sums in sorted(self._sums.items())
        )


def read_recorded(path: Any, system: str) -> Measured:
    """Return what a recording of `/diagnostics` says about a system.

    Args:
        path: An MCAP file, or a folder of rosbag2.
        system: The name of the system.

    Raises:
        RecordingError: It cannot be read.
        ComposerError: It has no such figures.
    """
    from composer.recordings.reading import read_recording

    recording = read_recording(path)
    if DIAGNOSTICS not in [each.name for each in recording.topics]:
        message = f"'{path}' has no messages of {DIAGNOSTICS}"
        advice = "record them with 'composer record', or 'composer up --record', while it works"
        raise ComposerError(message, help=advice)
    reader = _DiagnosticsReader(system)
    for _, _, message in recording.messages([DIAGNOSTICS]):
        reader.take(message)
    reader.check(str(path))
    return Measured(reader.averages.entities(), reader.cores, _mean_sizes(recording))


def _mean_sizes(recording: Any) -> dict[str, float]:
    """Return the mean sizes of all messages that a recording has."""
    totals: dict[str, tuple[int, int]] = {}
    for message in recording.raw_messages():
        count, size = totals.get(message.topic.name, (0, 0))
        totals[message.topic.name] = count + 1, size + len(message.data)
    return {name: size / count for name, (count, size) in totals.items()}


class _DiagnosticsReader:
    """Reads messages of `/diagnostics`.

    Attributes:
        cores: As the system says.
    """

    def __init__(self, system: str) -> None:
        self.averages = Averages()
        self.cores: int | None = None
        self._system = system
        self._others: set[str] = set()
        self._is_there = False
        self._lost: dict[str, tuple[float, int]] = {}

    def take(self, message: Any) -> None:
        """Take what a message says about the system."""
        stamp = message.header.stamp
        now_sec = stamp.sec + stamp.nanosec / 1e9
        for status in message.status:
            if status.hardware_id != self._system:
                self._others.add(status.hardware_id)
                continue
            self._is_there = True
            values = {pair.key: pair.value for pair in status.values}
            if values.get('cores', '').isdecimal():
                self.cores = int(values['cores'])
            task = _TASK.fullmatch(status.name)
            if task is not None and values.get('cpu (%)') and 'rate (Hz)' in values:
                # Somebody else may have written figures that are no numbers.
                with suppress(ValueError):
                    self._add(status.name, task, values, now_sec)

    def _add(
        self, name: str, task: re.Match[str], values: Mapping[str, str], now_sec: float
    ) -> None:
        lost = sum(int(values.get(key, '0')) for key in _LOST)
        before_sec, before = self._lost.get(name, (now_sec, lost))
        self._lost[name] = now_sec, lost
        passed_sec = now_sec - before_sec
        lost_hz = (lost - before) / passed_sec if passed_sec > 0 else 0.0
        self.averages.add(
            (task['node'], task['kind'], task['name'] or '', name),
            float(values['cpu (%)']) / _PERCENT,
            float(values['rate (Hz)']),
            lost_hz,
            values.get('worker', ''),
        )

    def check(self, path: str) -> None:
        """Raise an error if there is nothing of the system."""
        if not self._is_there:
            names = ', '.join(sorted(filter(None, self._others)))
            message = f"'{path}' says nothing about system '{self._system}'"
            advice = f'it is about: {names}' if names else 'no system of Composer is in it'
            raise ComposerError(message, help=advice)
        if not self.averages.entities():
            message = f"'{path}' does not say what the calls of '{self._system}' cost"
            advice = "the figures 'cpu (%)' are missing"
            raise ComposerError(message, help=advice)


def average_answers(answers: Iterable[Mapping[str, Any]]) -> tuple[EntityFigures, ...]:
    """Return the figures of answers of a running system to `composer top`.

    Periods in which calls were not measured are left out.
    """
    averages = Averages()
    before: dict[_Task, int] = {}
    for answer in answers:
        for each in answer['entities']:
            if each['cpu'] is None:
                continue
            task = each['node'], each['kind'], each['name'], each['key']
            lost = each['dropped'] - before.get(task, each['dropped'])
            before[task] = each['dropped']
            lost_hz = lost / answer['period_sec']
            averages.add(task, each['cpu'], each['rate_hz'], lost_hz, each['worker'])
    return averages.entities()
