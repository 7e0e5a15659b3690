"""What went wrong in a case, as its report has it: with places, and the events around it."""

from __future__ import annotations

import sys
import traceback
from bisect import bisect_left
from operator import attrgetter
from typing import TYPE_CHECKING

from composer.scenarios.running.case_results import CaseFailure
from composer.scenarios.times import format_seconds
from composer.simulation.trace import render_event
from composer.virtual_time.preemption import is_of_composer, is_own_code
from composer.virtual_time.stuck_threads import SimulationStuckError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from composer.diagnostics import Span
    from composer.errors import ComposerError
    from composer.scenarios.expectations.failures import Failure
    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.simulation.events import Event
    from composer.yaml_text.positions import DataPath

# So many events are shown before a moment, and from it on.
_BEFORE, _AFTER = 5, 5
_LONGEST_LINE = 240


def locate(loaded: LoadedScenarios, path: DataPath) -> Span:
    """Return where something stands in a scenario file."""
    positions = loaded.positions
    return positions.value(path) if isinstance(path[-1], int) else positions.key(path)


def describe_failure(
    loaded: LoadedScenarios, failure: Failure, events: Sequence[Event]
) -> CaseFailure:
    """Return an expectation that does not hold as the report has it."""
    return CaseFailure(
        'expectation',
        failure.message,
        locate(loaded, failure.path),
        tuple(failure.diff.splitlines()),
        tuple(show_around(events, failure.time_ns, failure.names)),
    )


def describe_error(error: ComposerError, events: Sequence[Event]) -> CaseFailure:
    """Return an error that ended a case as the report has it."""
    around = tuple(show_around(events, events[-1].time_ns if events else None, ()))
    if isinstance(error, SimulationStuckError):
        stack = '\n'.join(_list_stacks(error.thread))
        return CaseFailure('stuck', str(error), around=around, stack=stack)
    return CaseFailure('start', str(error), around=around)


def _list_stacks(stuck: int) -> Iterator[str]:
    """Yield the stack of the thread that is stuck, and of others that a behaviour waits in."""
    frames = sys._current_frames()  # noqa: SLF001 - the only way
    for ident in sorted(frames, key=lambda each: each != stuck):
        calls = traceback.extract_stack(frames[ident])
        shown = [each for each in calls if not is_of_composer(each.filename)]
        if ident == stuck or any(is_own_code(each.filename) for each in shown):
            title = 'It is at' if ident == stuck else 'Another thread waits at'
            yield f'{title}\n{"".join(traceback.format_list(shown or calls))}'


def show_around(
    events: Sequence[Event], time_ns: int | None, names: Iterable[str]
) -> Iterator[str]:
    """Yield the events around a moment, a line each; those with these names are marked.

    Args:
        time_ns: The moment; `None` for none, and no events.
        names: Of topics, nodes and so on.
    """
    if time_ns is None:
        return
    marked = frozenset(names)
    place = bisect_left(events, time_ns, key=attrgetter('time_ns'))
    shown = {*range(max(0, place - _BEFORE), min(len(events), place + _AFTER))}
    of_names = [i for i, event in enumerate(events) if not marked.isdisjoint(_names_of(event))]
    middle = bisect_left(of_names, place)
    shown |= {*of_names[max(0, middle - _BEFORE) : middle + _AFTER]}
    last = None
    for index in sorted(shown):
        if last is not None and index > last + 1:
            yield '  ...'
        mark = '> ' if not marked.isdisjoint(_names_of(events[index])) else '  '
        yield mark + _shortened(render_event(events[index]))
        last = index


def list_log(events: Iterable[Event]) -> Iterator[str]:
    """Yield the lines of the log with their times: `2.05 s [error] [/governor]: too fast`."""
    for event in events:
        if event.kind == 'log':
            time = format_seconds(event.time_ns)
            yield f'{time} [{event.name}] [{event.node or "composer"}]: {event.value}'


def _names_of(event: Event) -> tuple[str, str]:
    return event.name, event.node


def _shortened(line: str) -> str:
    return line if len(line) <= _LONGEST_LINE else f'{line[:_LONGEST_LINE]}…'
