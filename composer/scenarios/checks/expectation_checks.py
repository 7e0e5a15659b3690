"""Checks of expectations: that what they expect can happen at all."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from composer.interfaces.descriptions import MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.scenarios.checks.channels_of_cases import (
    check_type,
    explain_left_out,
    explain_unknown,
    is_known,
    publishes_itself,
)
from composer.scenarios.checks.message_fields import check_condition, check_message, part_of
from composer.scenarios.checks.node_values import (
    check_given_parameters,
    check_node_name,
    check_states,
)
from composer.scenarios.checks.recording_checks import check_like
from composer.scenarios.checks.time_checks import value_at
from composer.scenarios.specs import (
    ErrorExpectationSpec,
    LikeExpectationSpec,
    LogExpectationSpec,
    MessageExpectationSpec,
    OrderExpectationSpec,
    ParametersExpectationSpec,
    PublishStepSpec,
    RateExpectationSpec,
    StateExpectationSpec,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.diagnostics import Diagnostic
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import CaseSpec
    from composer.yaml_text.positions import DataPath

_CONDITIONS = ('where', 'never', 'eventually')


def check_expectations(context: ScenarioContext, case: CaseSpec) -> Iterator[Diagnostic]:
    """Check that something is expected, and each expectation against the system."""
    if not value_at(context, (*case.path, 'then')) and _only_publishes(context, case):
        yield context.at_value(
            (*case.path, 'then'),
            'nothing-expected',
            'this case expects nothing, and passes whatever happens',
            help="write what it shows, or {error: '*', never: true}",
        )
    for expected in case.expectations:
        check = _CHECKS.get(type(expected))
        if check is not None:
            yield from check(context, case, expected)


def _only_publishes(context: ScenarioContext, case: CaseSpec) -> bool:
    """Return whether no step of a case must have an outcome, nor one that is left out."""
    steps = value_at(context, (*case.path, 'when')) or ()
    is_whole = len(steps) == len(case.steps)
    return is_whole and all(isinstance(each, PublishStepSpec) for each in case.steps)


def _check_topic(
    context: ScenarioContext,
    case: CaseSpec,
    expected: MessageExpectationSpec | RateExpectationSpec,
) -> Iterator[Diagnostic]:
    yield from _check_pattern(context, case, expected.pattern.topic, expected.path)


def _check_order(
    context: ScenarioContext, case: CaseSpec, expected: OrderExpectationSpec
) -> Iterator[Diagnostic]:
    for pattern in expected.patterns:
        yield from _check_pattern(context, case, pattern.topic, pattern.path)


def _check_pattern(
    context: ScenarioContext, case: CaseSpec, topic: str, path: DataPath
) -> Iterator[Diagnostic]:
    yield from _check_publisher(context, case, topic, path)
    given = value_at(context, (*path, 'type'))
    description = part_of(context, 'topic', topic, 'message', given)
    for key in _CONDITIONS:
        yield from check_condition(context, description, (*path, key))
    yield from check_message(context, description, (*path, 'message'))


def _check_publisher(
    context: ScenarioContext, case: CaseSpec, topic: str, path: DataPath
) -> Iterator[Diagnostic]:
    """Check that somebody publishes on a topic: a node, the case itself, or a library."""
    at = (*path, 'topic')
    yield from check_type(context, 'topic', topic, path)
    if value_at(context, (*path, 'type')):
        return
    if context.has_own_end('topic', topic, provides=True) or context.is_of_ros('topic', topic):
        return
    if publishes_itself(case, topic):
        return
    if not is_known(context, 'topic', topic):
        yield explain_unknown(context, 'topic', topic, at, 'a library publishes it with node.ros')
        return
    message = f"no node of this system publishes '{topic}'"
    help_text = explain_left_out(context, 'topic', topic, provides=True)
    yield context.at_value(at, 'no-publisher', message, help=help_text)


def _check_like(
    context: ScenarioContext, case: CaseSpec, expected: LikeExpectationSpec
) -> Iterator[Diagnostic]:
    yield from _check_publisher(context, case, expected.topic, expected.path)
    yield from check_like(context, expected)
    description = part_of(context, 'topic', expected.topic, 'message', None)
    for index, ignored in enumerate(expected.ignored):
        yield from _check_field(context, description, ignored, (*expected.path, 'ignore', index))


def _check_field(
    context: ScenarioContext, description: MessageDescription | None, name: str, path: DataPath
) -> Iterator[Diagnostic]:
    """Check that a message has a field, as in `header.stamp`."""
    owner: Any = description
    for part in name.split('.'):
        if not isinstance(owner, MessageDescription):
            return
        field = owner.field(part)
        if field is None:
            error = unknown_field(owner.name, part, [each.name for each in owner.fields])
            yield context.at_value(path, 'unknown-field', str(error), part=part, help=error.help)
            return
        owner = context.describe(field.type.nested)


def _check_lines(
    context: ScenarioContext, _: CaseSpec, expected: LogExpectationSpec | ErrorExpectationSpec
) -> Iterator[Diagnostic]:
    key = 'log' if isinstance(expected, LogExpectationSpec) else 'error'
    yield from check_node_name(context, (*expected.path, key))
    if isinstance(value_at(context, (*expected.path, 'never')), str):
        message = "expected 'never: true': an expression knows no lines of a log"
        help_text = "write what the lines have in them, under 'text'"
        yield context.at_value((*expected.path, 'never'), 'wrong-type', message, help=help_text)
    if expected.regex is not None:
        try:
            re.compile(expected.regex)
        except re.error as error:
            message = f'this is no regular expression: {error}'
            yield context.at_value((*expected.path, 'matches'), 'bad-value', message)


def _check_parameters(
    context: ScenarioContext, _: CaseSpec, expected: ParametersExpectationSpec
) -> Iterator[Diagnostic]:
    yield from check_given_parameters(context, (*expected.path, 'parameters'))


def _check_state(
    context: ScenarioContext, _: CaseSpec, expected: StateExpectationSpec
) -> Iterator[Diagnostic]:
    yield from check_states(context, (*expected.path, 'state'))


_CHECKS: dict[type, Callable[[ScenarioContext, CaseSpec, Any], Iterator[Diagnostic]]] = {
    MessageExpectationSpec: _check_topic,
    RateExpectationSpec: _check_topic,
    OrderExpectationSpec: _check_order,
    LikeExpectationSpec: _check_like,
    LogExpectationSpec: _check_lines,
    ErrorExpectationSpec: _check_lines,
    ParametersExpectationSpec: _check_parameters,
    StateExpectationSpec: _check_state,
}
