"""Checks of what a case is given: parameters, a recording, stand-ins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.scenarios.checks.channels_of_cases import check_type, explain_unknown, is_known
from composer.scenarios.checks.message_fields import check_computed_message, part_of
from composer.scenarios.checks.node_values import check_given_parameters
from composer.scenarios.checks.recording_checks import check_recording_of_case

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import ActionStandInSpec, CaseSpec, ServiceStandInSpec
    from composer.yaml_text.positions import DataPath


def check_given(context: ScenarioContext, case: CaseSpec) -> Iterator[Diagnostic]:
    """Check what a case is given against the system."""
    given = case.given
    yield from check_given_parameters(context, (*given.path, 'parameters'))
    if given.recording is not None:
        yield from check_recording_of_case(context, given.recording, (*given.path, 'recording'))
    for service in given.services.values():
        yield from _check_service(context, service)
    for action in given.actions.values():
        yield from _check_action(context, action)


def _check_service(context: ScenarioContext, stand_in: ServiceStandInSpec) -> Iterator[Diagnostic]:
    name, path = stand_in.service, stand_in.path
    yield from _check_stand_in(context, 'service', name, path, has_type=stand_in.type is not None)
    request = part_of(context, 'service', name, 'request', stand_in.type)
    response = part_of(context, 'service', name, 'response', stand_in.type)
    yield from check_computed_message(context, response, (*path, 'response'), ('request', request))


def _check_action(context: ScenarioContext, stand_in: ActionStandInSpec) -> Iterator[Diagnostic]:
    name, path = stand_in.action, stand_in.path
    yield from _check_stand_in(context, 'action', name, path, has_type=stand_in.type is not None)
    goal = part_of(context, 'action', name, 'goal', stand_in.type)
    for part in ('result', 'feedback'):
        description = part_of(context, 'action', name, part, stand_in.type)
        if part == 'result':
            yield from check_computed_message(context, description, (*path, part), ('goal', goal))
            continue
        for index in range(len(stand_in.feedback)):
            at = (*path, part, index, 'message')
            yield from check_computed_message(context, description, at, ('goal', goal))


def _check_stand_in(
    context: ScenarioContext, kind: ChannelKind, name: str, path: DataPath, *, has_type: bool
) -> Iterator[Diagnostic]:
    yield from check_type(context, kind, name, path)
    channel = context.channel(kind, name)
    own = [end for end in channel.providers if not end.is_declared] if channel else []
    if own:
        message = f"'{name}' is served by {own[0].owner}: a stand-in would be a second server"
        yield context.at_key(path, 'second-server', message, help='remove the stand-in')
    elif not has_type and not is_known(context, kind, name):
        unknown = explain_unknown(context, kind, name, path)
        help_text = unknown.help or "write its 'type' if a behaviour calls it"
        yield context.at_key(path, unknown.rule, unknown.message, help=help_text)
