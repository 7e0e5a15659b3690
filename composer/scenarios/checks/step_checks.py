"""Checks of steps: what they publish on, call and set, and with which fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from composer.scenarios.checks.channels_of_cases import check_type, explain_unknown, is_known
from composer.scenarios.checks.message_fields import check_message, part_of
from composer.scenarios.checks.node_values import check_given_parameters, explain_node
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

    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import CaseSpec


_CLOCK: Final = '/clock'


def check_steps(context: ScenarioContext, case: CaseSpec) -> Iterator[Diagnostic]:
    """Check each step against the system."""
    for step in case.steps:
        yield from _CHECKS[type(step)](context, case, step)


def _check_publish(
    context: ScenarioContext, _: CaseSpec, step: PublishStepSpec
) -> Iterator[Diagnostic]:
    path = (*step.path, 'publish')
    if step.type is None and context.type_of('topic', step.topic) is None:
        if not context.channel('topic', step.topic):
            yield explain_unknown(context, 'topic', step.topic, path, "it is none of the system's")
        return
    yield from check_type(context, 'topic', step.topic, step.path)
    if not context.has_own_end('topic', step.topic, provides=False):
        yield context.at_value(
            path,
            'no-subscription',
            f"no node of this system subscribes to '{step.topic}'",
            help=_near_alone(context, 'topic', step.topic),
        )
    description = part_of(context, 'topic', step.topic, 'message', step.type)
    yield from check_message(context, description, (*step.path, 'message'))


def _near_alone(context: ScenarioContext, kind: ChannelKind, name: str) -> str | None:
    if context.channel(kind, name):
        return None
    if name == _CLOCK:
        return 'virtual time is the time of all clocks: what is published there sets none'
    help_text = context.suggest_channel(kind, name) or ''
    return help_text if help_text.startswith('did you mean') else None


def _check_call(
    context: ScenarioContext, case: CaseSpec, step: CallStepSpec
) -> Iterator[Diagnostic]:
    may_lack = step.fails or step.service in case.given.services
    yield from _check_server(context, ('service', step.service), step, may_lack=may_lack)
    for part in ('request', 'response'):
        description = part_of(context, 'service', step.service, part, step.type)
        yield from check_message(context, description, (*step.path, part))


def _check_goal(
    context: ScenarioContext, case: CaseSpec, step: GoalStepSpec
) -> Iterator[Diagnostic]:
    may_lack = step.action in case.given.actions
    yield from _check_server(context, ('action', step.action), step, may_lack=may_lack)
    for part in ('goal', 'result'):
        description = part_of(context, 'action', step.action, part, step.type)
        yield from check_message(context, description, (*step.path, part))
    feedback = part_of(context, 'action', step.action, 'feedback', step.type)
    for index in range(len(step.feedback or ())):
        yield from check_message(context, feedback, (*step.path, 'feedback', index))


def _check_server(
    context: ScenarioContext,
    channel: tuple[ChannelKind, str],
    step: CallStepSpec | GoalStepSpec,
    *,
    may_lack: bool,
) -> Iterator[Diagnostic]:
    """Check that a service or action is served, unless it may lack a server."""
    kind, name = channel
    path = (*step.path, 'call' if kind == 'service' else 'send_goal')
    yield from check_type(context, kind, name, step.path)
    is_served = context.has_own_end(kind, name, provides=True) or context.is_of_ros(kind, name)
    if is_served:
        return
    if step.type is None and not is_known(context, kind, name):
        yield explain_unknown(context, kind, name, path)
    elif not may_lack:
        message = f"no node of this system serves '{name}'"
        help_text = f"give it a stand-in, under 'given: {{{kind}s: …}}'"
        yield context.at_value(path, 'no-server', message, help=help_text)


def _check_set_parameters(
    context: ScenarioContext, _: CaseSpec, step: SetParametersStepSpec
) -> Iterator[Diagnostic]:
    path = (*step.path, 'set_parameters')
    yield from check_given_parameters(context, path, may_be_refused=step.refused)


def _check_action(
    context: ScenarioContext, _: CaseSpec, step: NodeStepSpec
) -> Iterator[Diagnostic]:
    spec = context.system.spec
    if not spec.nodes_named(step.name):
        yield explain_node(
            context, step.name, (*step.path, step.action), at_key=False, others=spec.workers
        )


def _check_fault(
    context: ScenarioContext, _: CaseSpec, step: TopicFaultStepSpec
) -> Iterator[Diagnostic]:
    if not is_known(context, 'topic', step.topic):
        yield explain_unknown(context, 'topic', step.topic, (*step.path, step.kind))


_CHECKS: dict[type, Callable[[ScenarioContext, CaseSpec, Any], Iterator[Diagnostic]]] = {
    PublishStepSpec: _check_publish,
    CallStepSpec: _check_call,
    GoalStepSpec: _check_goal,
    SetParametersStepSpec: _check_set_parameters,
    NodeStepSpec: _check_action,
    TopicFaultStepSpec: _check_fault,
}
