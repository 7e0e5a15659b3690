"""Expectations that stand in steps: responses, results, feedback, and refusals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.scenarios.expectations.diffs import render_differences, show_value
from composer.scenarios.expectations.failures import Failure
from composer.scenarios.expectations.matching import Comparison, find_distance
from composer.scenarios.expectations.wording import at_time, count_of
from composer.scenarios.specs import (
    CallStepSpec,
    GoalStepSpec,
    NodeStepSpec,
    PublishStepSpec,
    SetParametersStepSpec,
    TopicFaultStepSpec,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.scenarios.expectations.happenings import Happenings
    from composer.scenarios.outcomes import Outcome
    from composer.scenarios.specs import CaseSpec
    from composer.yaml_text.positions import DataPath


def check_outcome(outcome: Outcome) -> Iterator[Failure]:
    """Check what came of a step."""
    yield from _CHECKS[type(outcome.step)](outcome.step, outcome)


def check_undone(case: CaseSpec, happened: Happenings) -> Iterator[Failure]:
    """Check that a system that ends by itself has not ended before a step."""
    for event in happened.of_kind('exit')[:1]:
        for step in case.steps:
            if event.time_ns < step.schedule.at_ns <= case.until_ns:
                message = f'the step{at_time(step.schedule.at_ns)} is not done: the system ended'
                yield Failure(step.path, f'{message}{at_time(event.time_ns)}', '', event.time_ns)


def _check_publish(step: PublishStepSpec, outcome: Outcome) -> Iterator[Failure]:
    if outcome.problem is not None:
        yield _failure(outcome, 'publish', f'cannot publish on {step.topic}', (step.topic,))


def _check_call(step: CallStepSpec, outcome: Outcome) -> Iterator[Failure]:
    what, names = f'the call of {step.service}', (step.service,)
    if step.fails:
        if outcome.answer is not None:
            message = f'expected {what}{at_time(outcome.time_ns)} to fail, but there is a response'
            diff = f'+ {show_value(outcome.answer)}'
            yield Failure((*step.path, 'fails'), message, diff, outcome.time_ns, names)
        elif outcome.end_ns is None and outcome.problem is None:
            yield _failure(outcome, 'fails', f'{what} has not failed', names)
        return
    if outcome.answer is None:
        yield _failure(outcome, 'call', f'{what} has no response', names)
    elif step.response is not None:
        yield from _compare(outcome, 'response', step.response, outcome.answer, names)


def _check_goal(step: GoalStepSpec, outcome: Outcome) -> Iterator[Failure]:
    what, names = f'the goal of {step.action}', (step.action,)
    at = at_time(outcome.time_ns)
    if outcome.status is None:
        yield _failure(outcome, 'send_goal', f'{what} has no result', names)
        return
    if step.status is not None and outcome.status != step.status:
        message = f'expected {what}{at} to end as {step.status}, got {outcome.status}'
        key = 'status' if step.cancel_at_ns is not None else 'send_goal'
        diff = f'- {step.status}\n+ {outcome.status}'
        yield Failure((*step.path, key), message, diff, _end_of(outcome), names)
    if step.feedback is not None:
        yield from _check_feedback(step, outcome)
    if step.result is not None and outcome.answer is not None:
        yield from _compare(outcome, 'result', step.result, outcome.answer, names)
    elif step.result is not None and outcome.status == step.status:
        yield _failure(outcome, 'result', f'{what} has no result', names)


def _check_feedback(step: GoalStepSpec, outcome: Outcome) -> Iterator[Failure]:
    """Check that the feedback that is expected comes in its order; each is the first that fits."""
    compare = Comparison(step.tolerance).find_differences
    rest = list(outcome.feedback)
    for index, wanted in enumerate(step.feedback or ()):
        compared = [list(compare(wanted, each)) for each in rest]
        fitting = next((i for i, differences in enumerate(compared) if not differences), None)
        if fitting is not None:
            rest = rest[fitting + 1 :]
            continue
        message = (
            f'expected feedback {show_value(wanted)} of the goal of {step.action}'
            f'{at_time(outcome.time_ns)}, got none such among '
            f'{count_of(len(rest), "message")}{" after those before" if index else ""}'
        )
        nearest = min(compared, key=find_distance, default=[])
        path: DataPath = (*step.path, 'feedback', index)
        diff = render_differences(nearest)
        yield Failure(path, message, diff, _end_of(outcome), (step.action,))
        return


def _check_parameters(step: SetParametersStepSpec, outcome: Outcome) -> Iterator[Failure]:
    nodes = tuple(step.values)
    listed = ', '.join(nodes)
    if step.refused and outcome.answer:
        message = f'expected {listed} to refuse the parameters{at_time(outcome.time_ns)}'
        message += f', but {" and ".join(outcome.answer)} can be set'
        yield Failure((*step.path, 'refused'), message, '', outcome.time_ns, nodes)
    elif not step.refused and outcome.problem is not None:
        yield _failure(
            outcome, 'set_parameters', f'the parameters of {listed} cannot be set', nodes
        )


def _check_done(_step: NodeStepSpec | TopicFaultStepSpec, outcome: Outcome) -> Iterator[Failure]:
    if outcome.end_ns is None:
        yield _failure(outcome, 'at', 'the step has not ended', ())


def _compare(
    outcome: Outcome, key: str, wanted: Any, found: Any, names: tuple[str, ...]
) -> Iterator[Failure]:
    compare = Comparison(outcome.step.tolerance).find_differences  # type: ignore[union-attr]
    differences = list(compare(wanted, found))
    if differences:
        message = f'the {key} of {names[0]}{at_time(_end_of(outcome))} is not as expected'
        diff = render_differences(differences)
        yield Failure((*outcome.step.path, key), message, diff, _end_of(outcome), names)


def _failure(outcome: Outcome, key: str, message: str, names: tuple[str, ...]) -> Failure:
    """Return the failure of a step without an answer."""
    why = outcome.problem or 'the case ended before'
    return Failure(
        (*outcome.step.path, key),
        f'{message}{at_time(outcome.time_ns)}: {why}',
        '',
        _end_of(outcome),
        names,
    )


def _end_of(outcome: Outcome) -> int:
    return outcome.time_ns if outcome.end_ns is None else outcome.end_ns


_CHECKS: dict[type, Callable[[Any, Outcome], Iterator[Failure]]] = {
    PublishStepSpec: _check_publish,
    CallStepSpec: _check_call,
    GoalStepSpec: _check_goal,
    SetParametersStepSpec: _check_parameters,
    NodeStepSpec: _check_done,
    TopicFaultStepSpec: _check_done,
}
