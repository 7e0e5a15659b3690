"""Checks of times: nothing can be done, or expected, after the end of its case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.specs import GoalStepSpec
from composer.scenarios.times import format_seconds, to_nanoseconds

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Diagnostic
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import CaseSpec, StepSpec
    from composer.yaml_text.positions import DataPath

_RULE = 'after-the-end'
# Pairs of which the first is the lower one.
_PAIRS = ('within', 'between', 'rate', 'count')
_WINDOWS = ('within', 'between')


def check_times(context: ScenarioContext, case: CaseSpec) -> Iterator[Diagnostic]:
    """Check the times of steps and expectations against each other, and the end of the case."""
    if value_at(context, (*case.path, 'until')) is value_at(context, ('until',)) is None:
        return
    for step in case.steps:
        yield from _check_step(context, case, step)
    for expected in case.expectations:
        yield from _check_pairs(context, case, expected.path)
        yield from _check_moment(context, case, (*expected.path, 'at'))


def _check_step(context: ScenarioContext, case: CaseSpec, step: StepSpec) -> Iterator[Diagnostic]:
    late = list(_check_moment(context, case, (*step.path, 'at')))
    yield from late
    schedule = step.schedule
    if schedule.every_ns is not None and schedule.times is not None and not late:
        last = schedule.at_ns + (schedule.times - 1) * schedule.every_ns
        if last > case.until_ns:
            possible = len(list(schedule.list_times(case.until_ns)))
            message = (
                f'the last of {schedule.times} is at {format_seconds(last)}, '
                f'and the case ends at {format_seconds(case.until_ns)}'
            )
            help_text = f'{possible} fit; without times, it goes on to the end'
            yield context.at_value((*step.path, 'times'), _RULE, message, help=help_text)
    if isinstance(step, GoalStepSpec) and step.cancel_at_ns is not None:
        path = (*step.path, 'cancel_at')
        yield from _check_moment(context, case, path)
        if step.cancel_at_ns < schedule.at_ns:
            sent = format_seconds(schedule.at_ns)
            message = f'the goal is cancelled before it is sent, at {sent}'
            yield context.at_value(path, 'bad-value', message)


def _check_moment(
    context: ScenarioContext, case: CaseSpec, path: DataPath
) -> Iterator[Diagnostic]:
    value = value_at(context, path)
    if value is not None and to_nanoseconds(value) > case.until_ns:
        yield _explain(context, case, path, value)


def _explain(
    context: ScenarioContext, case: CaseSpec, path: DataPath, seconds: float
) -> Diagnostic:
    time, end = format_seconds(to_nanoseconds(seconds)), format_seconds(case.until_ns)
    return context.at_value(
        path,
        _RULE,
        f'{time} is after the end of the case, which is at {end}',
        help="let the case last longer, with 'until'",
    )


def _check_pairs(context: ScenarioContext, case: CaseSpec, path: DataPath) -> Iterator[Diagnostic]:
    for key in _PAIRS:
        pair = value_at(context, (*path, key))
        if not isinstance(pair, list):
            continue
        low, high = pair
        if low > high:
            message = f'{low} is more than {high}: the lower one comes first'
            help_text = f'did you mean [{high}, {low}]?'
            yield context.at_value((*path, key), 'bad-value', message, help=help_text)
        elif key == 'between' and low == high:
            message = 'a rate needs some time to be measured over'
            yield context.at_value((*path, key), 'bad-value', message)
        elif key in _WINDOWS and to_nanoseconds(high) > case.until_ns:
            yield _explain(context, case, (*path, key, 1), high)


def value_at(context: ScenarioContext, path: DataPath) -> Any:
    """Return the value at a path of the file; `None` if there is none."""
    value: Any = context.loaded.document.data
    for key in path:
        if isinstance(value, dict):
            value = value.get(str(key))
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            value = value[key]
        else:
            return None
    return value
