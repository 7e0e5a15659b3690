"""Expectations on the parameters of nodes, and on the states of their lifecycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.records import record
from composer.scenarios.expectations.diffs import render_differences, show_value
from composer.scenarios.expectations.failures import Failure
from composer.scenarios.expectations.matching import Comparison
from composer.scenarios.expectations.wording import at_time, in_window
from composer.scenarios.specs import WindowSpec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.scenarios.expectations.happenings import Happenings
    from composer.scenarios.specs import ParametersExpectationSpec, StateExpectationSpec

# What a lifecycle begins with.
FIRST_STATE = 'unconfigured'


@record
class _Wanted:
    """A value that is expected, of what in words, of which node."""

    what: str
    node: str
    value: Any
    tolerance: float = 0.0


def check_parameters(
    expected: ParametersExpectationSpec, happened: Happenings
) -> Iterator[Failure]:
    """Check the values of parameters."""
    for node, values in expected.values.items():
        for name, value in values.items():
            history = _history_of_parameter(happened, node, name)
            wanted = _Wanted(f"parameter '{name}' of {node}", node, value, expected.tolerance)
            yield from _check_history(expected, happened, history, wanted)


def check_state(expected: StateExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check the states of lifecycles."""
    for node, state in expected.states.items():
        events = [each for each in happened.of_kind('state') if each.node == node]
        history = [(0, FIRST_STATE), *((each.time_ns, each.value) for each in events)]
        yield from _check_history(
            expected, happened, history, _Wanted(f'state of {node}', node, state)
        )


def _history_of_parameter(happened: Happenings, node: str, name: str) -> list[tuple[int, Any]]:
    first = happened.parameters.get(node, {})
    events = (
        each for each in happened.of_kind('parameter') if each.node == node and each.name == name
    )
    start = [(0, first[name])] if name in first else []
    return [*start, *((each.time_ns, each.value) for each in events)]


def _check_history(
    expected: ParametersExpectationSpec | StateExpectationSpec,
    happened: Happenings,
    history: list[tuple[int, Any]],
    wanted: _Wanted,
) -> Iterator[Failure]:
    """Compare the values that something has had with the one that is expected.

    Args:
        history: From when on it had which value, in order.
    """
    moment = happened.end_ns if expected.at_ns is None else expected.at_ns
    window = expected.window
    found = _values_in(history, window or WindowSpec(moment, moment))
    compare = Comparison(wanted.tolerance).find_differences
    differences = [list(compare(wanted.value, each)) for _, each in found]
    if any(not each for each in differences):
        return
    place = in_window(window) if window else at_time(moment)
    time = (window.end_ns or happened.end_ns) if window else moment
    if not found:
        message, diff = f'{wanted.what} has no value{place}', ''
    else:
        got = show_value(found[-1][1])
        message = f'expected {show_value(wanted.value)} as {wanted.what}{place}, got {got}'
        diff = render_differences(differences[-1])
    yield Failure(expected.path, message, diff, time, (wanted.node,))


def _values_in(history: list[tuple[int, Any]], window: WindowSpec) -> list[tuple[int, Any]]:
    """Return the values that it has at some time of a window: the last before it, and new ones.

    At a single moment, that is the last value of that moment.
    """
    before = [each for each in history if each[0] <= window.start_ns][-1:]
    if window.start_ns == window.end_ns:
        return before
    return before + [each for each in history if each[0] > window.start_ns and window.has(each[0])]
