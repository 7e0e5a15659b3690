"""The steps of a case: each is done at its times, and what came of it is kept."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from composer.errors import (
    CallError,
    ComposerError,
    GoalRejectedError,
    ParametersRefusedError,
    SystemStoppingError,
)
from composer.scenarios.outcomes import Outcome
from composer.scenarios.running.case_results import CaseFailure
from composer.scenarios.running.failure_reports import locate
from composer.scenarios.specs import (
    CallStepSpec,
    GoalStepSpec,
    NodeStepSpec,
    PublishStepSpec,
    SetParametersStepSpec,
    TopicFaultStepSpec,
)
from composer.scenarios.times import NANOSECONDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.scenarios.specs import CaseSpec, StepSpec
    from composer.simulation.scenario_node import SimulatedGoal
    from composer.simulation.simulated_system import SimulatedSystem


class CaseSteps:
    """Does the steps of a case.

    Attributes:
        failures: Steps that could not be done.
        has_ended: Whether the case has ended: what still comes is no outcome of a step.
    """

    def __init__(
        self, simulated: SimulatedSystem, loaded: LoadedScenarios, case: CaseSpec
    ) -> None:
        self._simulated = simulated
        self._loaded = loaded
        self._case = case
        self._outcomes: list[Outcome] = []
        self.failures: list[CaseFailure] = []
        self.has_ended = False

    def schedule(self) -> None:
        """Ask for each step at its first time; it asks for the next ones itself."""
        for step in self._case.steps:
            self._schedule_next(step, step.schedule.list_times(self._case.until_ns))

    def outcomes(self) -> list[Outcome]:
        """Return what came of the steps, by the time at which they were done."""
        return sorted(self._outcomes, key=lambda outcome: outcome.time_ns)

    def _schedule_next(self, step: StepSpec, times: Iterator[int]) -> None:
        time_ns = next(times, None)
        if time_ns is not None:
            act = partial(self._act, step, time_ns, times)
            self._simulated.at(time_ns / NANOSECONDS, act)

    def _act(self, step: StepSpec, time_ns: int, times: Iterator[int]) -> None:
        self._schedule_next(step, times)
        place = len(self._outcomes)
        # Until it has ended.
        self._outcomes.append(Outcome(step, time_ns))
        try:
            outcome = self._do(step, time_ns)
            if self.has_ended:
                outcome = Outcome(step, time_ns, feedback=outcome.feedback)
            self._outcomes[place] = outcome
        except SystemStoppingError:
            pass
        except ComposerError as error:
            self.failures.append(CaseFailure('step', str(error), locate(self._loaded, step.path)))

    def _do(self, step: StepSpec, time_ns: int) -> Outcome:
        match step:
            case PublishStepSpec():
                return self._publish(step, time_ns)
            case CallStepSpec():
                return self._call(step, time_ns)
            case GoalStepSpec():
                return self._send_goal(step, time_ns)
            case SetParametersStepSpec():
                return self._set_parameters(step, time_ns)
            case NodeStepSpec():
                self._simulated.act_on(step.action, step.name)
            case TopicFaultStepSpec():
                self._simulated.disturb(step.kind, step.topic, step.seconds, step.delay_sec)
        return Outcome(step, time_ns, self._now_ns())

    def _publish(self, step: PublishStepSpec, time_ns: int) -> Outcome:
        self._simulated.publish(step.topic, step.message, step.type)
        return Outcome(step, time_ns, self._now_ns())

    def _call(self, step: CallStepSpec, time_ns: int) -> Outcome:
        try:
            answer = self._simulated.call(
                step.service, step.request, step.timeout_sec, type=step.type
            )
        except CallError as error:
            return Outcome(step, time_ns, self._now_ns(), problem=str(error))
        return Outcome(step, time_ns, self._now_ns(), answer)

    def _send_goal(self, step: GoalStepSpec, time_ns: int) -> Outcome:
        try:
            goal = self._simulated.send_goal(
                step.action, step.goal, step.timeout_sec, type=step.type
            )
        except GoalRejectedError as error:
            return Outcome(step, time_ns, self._now_ns(), status='rejected', problem=str(error))
        if step.cancel_at_ns is not None:
            self._simulated.at(step.cancel_at_ns / NANOSECONDS, partial(_cancel, goal))
        try:
            goal.goal.result()
        except SystemStoppingError:
            return Outcome(step, time_ns, feedback=tuple(goal.feedback))
        return Outcome(
            step,
            time_ns,
            self._now_ns(),
            answer=goal.result,
            status=goal.status,
            feedback=tuple(goal.feedback),
        )

    def _set_parameters(self, step: SetParametersStepSpec, time_ns: int) -> Outcome:
        was_set, refusals = [], []
        for node, values in step.values.items():
            each_alone = [{name: value} for name, value in values.items()]
            for together in [dict(values)] if step.atomically else each_alone:
                try:
                    self._simulated.set_parameters(node, together, atomically=step.atomically)
                    was_set += [f"'{name}' of {node}" for name in together]
                except ParametersRefusedError as error:
                    refusals.append(str(error))
        return Outcome(
            step, time_ns, self._now_ns(), answer=was_set, problem='; '.join(refusals) or None
        )

    def _now_ns(self) -> int:
        return round(self._simulated.now * NANOSECONDS)


def _cancel(goal: SimulatedGoal) -> None:
    # One that has ended meanwhile is not there any more.
    with suppress(ComposerError):
        goal.cancel()
