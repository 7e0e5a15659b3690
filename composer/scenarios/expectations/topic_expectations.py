"""Expectations on the messages of topics: how many, how often, in which order, and which."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from itertools import islice, pairwise
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.limits import Budget
from composer.expressions.sandbox import Sandbox
from composer.scenarios.expectations.diffs import render_differences, show_value
from composer.scenarios.expectations.failures import Failure
from composer.scenarios.expectations.matching import Comparison, find_distance
from composer.scenarios.expectations.wording import at_time, count_of, expected_count, in_window
from composer.scenarios.fields import MessageView, explain_error
from composer.scenarios.specs import WindowSpec
from composer.scenarios.times import NANOSECONDS, to_fraction

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.scenarios.expectations.happenings import Happenings, PublishedMessage
    from composer.scenarios.expectations.matching import Difference
    from composer.scenarios.specs import (
        LikeExpectationSpec,
        MessageExpectationSpec,
        OrderExpectationSpec,
        PatternSpec,
        RateExpectationSpec,
    )

# Of more messages, the nearest is searched for among the last.
_MOST_COMPARED = 200
# The name of the whole message in a condition.
MESSAGE = 'message'
# The first messages that differ are shown.
_MOST_SHOWN = 3


class _Unevaluated(Exception):  # noqa: N818 - caught in this module
    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.message)
        self.failure = failure


def check_messages(expected: MessageExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check how many messages there are."""
    try:
        yield from _check_count(expected, happened)
    except _Unevaluated as error:
        yield error.failure


def check_rate(expected: RateExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check how many messages there are in a second; the end of the window is not part of it."""
    start = expected.window.start_ns
    end = happened.end_ns if expected.window.end_ns is None else expected.window.end_ns
    window = WindowSpec(start, end - 1)
    try:
        found = _matching(expected.pattern, happened.of_topic(expected.pattern.topic, window))
        count = sum(1 for _ in found)
    except _Unevaluated as error:
        yield error.failure
        return
    if end <= start:
        message = f'the rate cannot be measured: the case ended{at_time(happened.end_ns)}'
        yield _failure(expected.pattern, message, happened.end_ns)
        return
    rate = Fraction(count * NANOSECONDS, end - start)
    lowest, highest = to_fraction(expected.lowest), to_fraction(expected.highest)
    if not lowest <= rate <= highest:
        place = in_window(WindowSpec(start, end))
        message = (
            f'expected {expected.lowest:g} to {expected.highest:g} messages a second on '
            f'{expected.pattern.topic}{place}, got {float(rate):.6g} '
            f'({count_of(count, "message")})'
        )
        yield _failure(expected.pattern, message, _longest_gap(expected, happened, window))


def _longest_gap(
    expected: RateExpectationSpec, happened: Happenings, window: WindowSpec
) -> int | None:
    """Return the beginning of the longest time without a message."""
    found = happened.of_topic(expected.pattern.topic, window)
    times = [window.start_ns, *(each.time_ns for each in found), window.end_ns or 0]
    gaps = [(later - time, -time) for time, later in pairwise(times)]
    return -max(gaps)[1]


def check_order(expected: OrderExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that messages come one after the other; each is the first that fits."""
    last: PublishedMessage | None = None
    try:
        for number, pattern in enumerate(expected.patterns, start=1):
            found = happened.of_topic(pattern.topic, expected.window)
            later = (each for each in found if last is None or each.index > last.index)
            following = next(_matching(pattern, later), None)
            if following is None:
                yield _explain_order(expected, number, last)
                return
            last = following
    except _Unevaluated as error:
        yield error.failure


def _explain_order(
    expected: OrderExpectationSpec, number: int, last: PublishedMessage | None
) -> Failure:
    pattern = expected.patterns[number - 1]
    after = ''
    if last is not None:
        before = expected.patterns[number - 2]
        after = f' after that of {before.topic}{at_time(last.time_ns)}'
    message = (
        f'expected message {number} of the order, {_describe(pattern)}'
        f'{after}{in_window(expected.window)}, got none'
    )
    time = last.time_ns if last else expected.window.start_ns
    names = tuple(dict.fromkeys(each.topic for each in expected.patterns))
    return Failure(pattern.path, message, '', time, names)


def _check_count(expected: MessageExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    pattern = expected.pattern
    messages = list(happened.of_topic(pattern.topic, expected.window))
    found = list(_matching(pattern, messages))
    if expected.least <= len(found) and (expected.most is None or len(found) <= expected.most):
        return
    if len(found) < expected.least:
        yield _explain_too_few(expected, happened, messages, found)
    else:
        yield _explain_too_many(expected, found)


def _explain_too_many(expected: MessageExpectationSpec, found: list[PublishedMessage]) -> Failure:
    pattern = expected.pattern
    # The first that is too many.
    culprit = found[expected.most or 0]
    message = (
        f'expected {expected_count(expected.least, expected.most, "message")} {_what(pattern)}'
        f'{in_window(expected.window)}, got {count_of(len(found), "message")}, '
        f'the first{" too many" if expected.most else ""}{at_time(culprit.time_ns)}'
    )
    return _failure(pattern, message, culprit.time_ns, f'+ {show_value(culprit.message)}')


def _explain_too_few(
    expected: MessageExpectationSpec,
    happened: Happenings,
    messages: list[PublishedMessage],
    found: list[PublishedMessage],
) -> Failure:
    pattern = expected.pattern
    wanted = expected_count(expected.least, expected.most, 'message')
    message = f'expected {wanted} {_what(pattern)}{in_window(expected.window)}, got '
    message += f'{len(found)}' if found else 'none'
    if not found and messages:
        message += f' among {count_of(len(messages), "message")}'
    outside = _find_outside(expected, happened)
    if outside is not None:
        message += f'; there is one{at_time(outside.time_ns)}'
    near = _find_nearest(pattern, messages)
    if near is None or found:
        last = found[-1].time_ns if found else expected.window.end_ns
        time = outside.time_ns if outside else last
        return _failure(pattern, message, time)
    nearest, differences = near
    diff = render_differences(differences) if differences else f'+ {show_value(nearest.message)}'
    message += f'; the nearest is that{at_time(nearest.time_ns)}' if differences else ''
    return _failure(pattern, message, nearest.time_ns, diff)


def _find_outside(
    expected: MessageExpectationSpec, happened: Happenings
) -> PublishedMessage | None:
    """Return the message that would fit, but is nearest to the window only."""
    start, end = expected.window.start_ns, expected.window.end_ns
    if end is None:
        return None
    every = happened.of_topic(expected.pattern.topic, WindowSpec())
    others = sorted(
        (each for each in every if not expected.window.has(each.time_ns)),
        key=lambda each: max(start - each.time_ns, each.time_ns - end),
    )
    return next(_matching(expected.pattern, others), None)


def _find_nearest(
    pattern: PatternSpec, messages: list[PublishedMessage]
) -> tuple[PublishedMessage, list[Difference]] | None:
    """Return the message with the nearest values, or the last one if only `where` counts."""
    if pattern.message is None:
        return (messages[-1], []) if messages else None
    recent = messages[-_MOST_COMPARED:]
    held = [each for each in recent if _holds(pattern, each)] or recent
    compare = Comparison(pattern.tolerance).find_differences
    compared = [(each, list(compare(pattern.message, each.message))) for each in held]
    return min(compared, key=lambda pair: find_distance(pair[1]), default=None)


def _matching(
    pattern: PatternSpec, messages: Iterable[PublishedMessage]
) -> Iterator[PublishedMessage]:
    """Yield the messages that a pattern means."""
    compare = Comparison(pattern.tolerance).find_differences
    for each in messages:
        if not _holds(pattern, each):
            continue
        is_other = pattern.message is not None and any(compare(pattern.message, each.message))
        if not is_other:
            yield each


def _holds(pattern: PatternSpec, each: PublishedMessage) -> bool:
    if pattern.where is None:
        return True
    try:
        return condition_of(pattern.where).holds(each.message)
    except ConditionError as error:
        message = (
            f'{pattern.where!r} cannot be evaluated for the message on {pattern.topic}'
            f'{at_time(each.time_ns)}: {error}'
        )
        diff = f'+ {show_value(each.message)}'
        failure = Failure(pattern.where_path, message, diff, each.time_ns, (pattern.topic,))
        raise _Unevaluated(failure) from error


def _describe(pattern: PatternSpec) -> str:
    """Return `a message on /scan where data > 1`."""
    return f'a message {_what(pattern)}'


def _what(pattern: PatternSpec) -> str:
    text = f'on {pattern.topic}'
    if pattern.where is not None:
        text += f' where {pattern.where}'
    if pattern.message is not None:
        text += f' with {show_value(pattern.message)}'
    return text


def _failure(pattern: PatternSpec, message: str, time_ns: int | None, diff: str = '') -> Failure:
    return Failure(pattern.path, message, diff, time_ns, (pattern.topic,))


class _NoBudget(Budget):
    """Counts no work: a case has thousands of messages, and runs behaviours of the same author."""

    def spend(self, *_values: Any) -> None:
        pass

    def spend_on_parsing(self, code: str) -> None:
        pass

    def collect(self, items: Iterable[Any]) -> list[Any]:
        return list(items)


class ConditionError(ComposerError):
    """A condition cannot be evaluated for a message."""


class Condition:
    """An expression over the fields of a message, and the message as `message`."""

    def __init__(self, code: str) -> None:
        self.code = code
        self._sandbox = Sandbox()
        self._sandbox.budget = _NoBudget()
        self._names: frozenset[str] | None = None

    def holds(self, message: Any) -> bool:
        """Return whether the condition holds for a message.

        Raises:
            ConditionError: The expression is wrong, or the message lacks what it asks for, as an
                item of an array that is too short.
        """
        try:
            if self._names is None:
                self._names = self._sandbox.names_in(self.code)
            view = MessageView(message)
            fields = message.get_fields_and_field_types()
            # A field that is called so, too, hides the message, as in the checks.
            scope: dict[str, Any] = {MESSAGE: view}
            scope |= {name: getattr(view, name) for name in self._names if name in fields}
            return bool(evaluate_expression(self._sandbox, self.code, scope))
        except Exception as error:
            raise ConditionError(explain_error(error)) from error


@lru_cache(maxsize=256)
def condition_of(code: str) -> Condition:
    """Return the condition of an expression; each is parsed once."""
    return Condition(code)


def check_like(expected: LikeExpectationSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that a topic has the messages that were recorded, in their order."""
    # Most cases compare nothing with a recording.
    from composer.recordings.reading import read_recording
    from composer.recordings.recorded_topics import RecordingError

    at = (*expected.path, 'like')
    try:
        recording = read_recording(expected.recording)
        recorded = [each for _, _, each in recording.messages([expected.topic])]
    except RecordingError as error:
        yield Failure(at, str(error))
        return
    if not any(each.name == expected.topic for each in recording.topics):
        yield Failure(at, f'{expected.recording} has no messages of {expected.topic}')
        return
    yield from compare_messages(expected, recorded, happened)


def compare_messages(
    expected: LikeExpectationSpec, recorded: list[Any], happened: Happenings
) -> Iterator[Failure]:
    """Compare the messages of a topic with those that were recorded."""
    found = list(happened.of_topic(expected.topic, WindowSpec()))
    ignored = frozenset(tuple(each.split('.')) for each in expected.ignored)
    comparison = Comparison(expected.tolerance, ignored)
    pairs = enumerate(zip(recorded, found, strict=False), start=1)
    differing = (
        (number, each, differences)
        for number, (wanted, each) in pairs
        if (differences := list(comparison.find_differences(wanted, each.message)))
    )
    names = (expected.topic,)
    at = (*expected.path, 'like')
    for number, each, differences in islice(differing, _MOST_SHOWN):
        message = f'message {number} on {expected.topic}{at_time(each.time_ns)} is not as recorded'
        yield Failure(at, message, render_differences(differences), each.time_ns, names)
    if len(recorded) != len(found):
        message = (
            f'{expected.topic} has {count_of(len(found), "message")}, '
            f'and {count_of(len(recorded), "message")} in the recording'
        )
        is_longer = len(found) > len(recorded)
        time = found[len(recorded)].time_ns if is_longer else happened.end_ns
        odd = found[len(recorded)].message if is_longer else recorded[len(found)]
        diff = f'{"+" if is_longer else "-"} {show_value(odd)}'
        yield Failure(at, message, diff, time, names)
