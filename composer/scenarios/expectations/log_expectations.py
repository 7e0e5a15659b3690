"""Expectations on the log, on errors of behaviours, and on the end of the system."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.scenarios.expectations.diffs import show_value
from composer.scenarios.expectations.failures import Failure
from composer.scenarios.expectations.wording import at_time, count_of, expected_count, in_window
from composer.scenarios.specs import ErrorExpectationSpec, ExitExpectationSpec
from composer.simulation.trace import error_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from composer.scenarios.expectations.happenings import Happenings
    from composer.scenarios.specs import CaseSpec, LogExpectationSpec
    from composer.simulation.events import Event

_LEVELS = {name: rank for rank, name in enumerate(('debug', 'info', 'warn', 'error', 'fatal'))}
# The name of the end of a system that has refused to start.
START = 'start'
# What rclpy calls it.
_LEVELS['warning'] = _LEVELS['warn']
# Of a longer traceback, the last lines are shown.
_MOST_LINES = 24
_MOST_OTHERS = 8


def check_log(expected: LogExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check how many lines there are in the log."""
    lowest = _LEVELS[expected.level or 'debug']
    found = [
        each
        for each in happened.of_kind('log', expected.window)
        if _LEVELS.get(each.name, 0) >= lowest and _is_meant(expected, each)
    ]
    what = 'line' if expected.level is None else f'{expected.level} line'
    yield from _check_count(expected, found, what, happened, 'log')


def check_error(expected: ErrorExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check how many errors behaviours raise."""
    errors = happened.of_kind('error', expected.window)
    found = [each for each in errors if _is_meant(expected, each)]
    yield from _check_count(expected, found, 'error', happened, 'error')


def _is_meant(expected: LogExpectationSpec | ErrorExpectationSpec, event: Event) -> bool:
    text = str(event.value)
    return (
        expected.node in (None, event.node)
        and (expected.text is None or expected.text in text)
        and (expected.regex is None or re.search(expected.regex, text) is not None)
    )


def _check_count(
    expected: LogExpectationSpec | ErrorExpectationSpec,
    found: list[Event],
    noun: str,
    happened: Happenings,
    kind: str,
) -> Iterator[Failure]:
    if expected.least <= len(found) and (expected.most is None or len(found) <= expected.most):
        return
    wanted = expected_count(expected.least, expected.most, noun)
    message = f'expected {wanted} of {expected.node or "any node"}'
    message += f' with {show_value(expected.text)}' if expected.text is not None else ''
    message += f' that matches {show_value(expected.regex)}' if expected.regex is not None else ''
    others = [] if found else _find_others(expected, happened.of_kind(kind))
    listed = count_of(len(others), 'error' if kind == 'error' else 'line')
    got = f'none among {listed}' if others else count_of(len(found), noun)
    message += f'{in_window(expected.window)}, got {got}'
    names = (expected.node,) if expected.node else ()
    time, diff = expected.window.end_ns or happened.end_ns, _list(others)
    if len(found) > expected.least:
        culprit = found[min(expected.most or 0, len(found) - 1)]
        message += at_time(culprit.time_ns) if len(found) == 1 else ''
        time, diff = culprit.time_ns, f'+ {_in_one_line(culprit)}'
    yield Failure(expected.path, message, diff, time, names)


def _find_others(
    expected: LogExpectationSpec | ErrorExpectationSpec, events: Iterable[Event]
) -> list[Event]:
    """Return what there is instead: of the node, or if it has none, of all; at any time."""
    every = list(events)
    return [each for each in every if expected.node in (None, each.node)] or every


def _list(events: Sequence[Event]) -> str:
    """Return the first of each text, a line each, as many as are shown."""
    first: dict[str, Event] = {}
    for event in events:
        level = f'{event.name}: ' if event.kind == 'log' else ''
        owner = f'{event.node}: ' if event.node else ''
        first.setdefault(f'+ {owner}{level}{_in_one_line(event)}', event)
    lines = [f'{text}{at_time(event.time_ns)}' for text, event in first.items()]
    more = len(lines) - _MOST_OTHERS
    return '\n'.join([*lines[:_MOST_OTHERS], *[f'  … and {more} more'] * (more > 0)])


def check_unexpected_errors(case: CaseSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that no behaviour raises an error that no expectation names; each is told once."""
    expected = [each for each in case.expectations if isinstance(each, ErrorExpectationSpec)]
    unexpected: dict[tuple[str, str, str], list[Event]] = {}
    refused = [each for each in happened.of_kind('exit') if each.name == START]
    ends = any(isinstance(each, ExitExpectationSpec) for each in case.expectations)
    for event in happened.of_kind('error'):
        if refused and ends:
            # The exit code says so.
            continue
        is_expected = any(
            _is_meant(each, event) and each.window.has(event.time_ns) for each in expected
        )
        if not is_expected:
            key = event.node, event.name, error_line(str(event.value))
            unexpected.setdefault(key, []).append(event)
    for (node, name, line), events in unexpected.items():
        more = f', and {_times(len(events) - 1)}' if len(events) > 1 else ''
        owner = f'{name} of {node}' if node else name
        message = f'{owner} raised {line}{at_time(events[0].time_ns)}{more}'
        lines = str(events[0].value).rstrip().splitlines()
        cut = ['  …', *lines[-_MOST_LINES:]] if len(lines) > _MOST_LINES else lines
        yield Failure(case.path, message, '\n'.join(cut), events[0].time_ns, (node,))


def _in_one_line(event: Event) -> str:
    text = str(event.value).strip()
    return error_line(text) if event.kind == 'error' else text.partition('\n')[0]


def _times(number: int) -> str:
    return 'once more' if number == 1 else f'{number} more times'


def check_exit(expected: ExitExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that the system ends by itself, with a code."""
    exits = happened.of_kind('exit')
    wanted = (
        f'expected the system to end with exit code {expected.code}{in_window(expected.window)}'
    )
    at = (*expected.path, 'exit_code')
    if not exits:
        yield Failure(at, f'{wanted}, but it ran on', '', happened.end_ns)
        return
    found = exits[0]
    if found.value != expected.code:
        message = f'{wanted}, got {found.value}{at_time(found.time_ns)}'
        yield Failure(at, message, f'- {expected.code}\n+ {found.value}', found.time_ns)
    elif not expected.window.has(found.time_ns):
        yield Failure(at, f'{wanted}, but it ended{at_time(found.time_ns)}', '', found.time_ns)


def expects_refusal(case: CaseSpec) -> bool:
    """Return whether a case expects an error or an end, which may be at the start."""
    return any(
        isinstance(each, ExitExpectationSpec)
        or (isinstance(each, ErrorExpectationSpec) and each.most != 0)
        for each in case.expectations
    )


def check_unexpected_exit(case: CaseSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that the system does not fail without an expectation that says so."""
    if any(isinstance(each, ExitExpectationSpec) for each in case.expectations):
        return
    for event in happened.of_kind('exit')[:1]:
        # An error that is expected is the reason of a system that has refused to start.
        if event.value and event.name != START:
            message = f'the system ended with exit code {event.value}{at_time(event.time_ns)}'
            yield Failure(case.path, message, '', event.time_ns)
