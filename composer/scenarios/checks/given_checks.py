"""Checks of what a case is given: parameters, a recording, stand-ins."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING

from composer.interfaces.descriptions import MessageDescription
from composer.python_source.module_finder import MissingModule
from composer.scenarios.checks.channels_of_cases import check_type, explain_unknown, is_known
from composer.scenarios.checks.message_fields import (
    check_computed_message,
    check_message,
    part_of,
)
from composer.scenarios.checks.node_values import check_given_parameters
from composer.scenarios.checks.recording_checks import check_recorded, check_recording_of_case
from composer.scenarios.checks.scenario_context import suggest_full_name
from composer.scenarios.specs import find_sources
from composer.spelling import did_you_mean, suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import (
        ActionStandInSpec,
        CaseSpec,
        ServiceStandInSpec,
        SourceInputSpec,
    )
    from composer.yaml_text.positions import DataPath

_SOURCE = 'unknown-source'
# What a module may make names with that nobody can read.
_SETS_NAMES = re.compile(rb'\b(globals|locals|vars|exec|eval|setattr)\b')


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
    for source in given.sources:
        yield from _check_source(context, source)
    for old, new in given.replace.items():
        path = (*given.path, 'replace', old)
        yield from _check_object(context, old, partial(context.at_key, path))
        yield from _check_object(context, new, partial(context.at_value, path))


def _check_source(context: ScenarioContext, given: SourceInputSpec) -> Iterator[Diagnostic]:
    nodes = context.system.spec.nodes.values()
    found = find_sources(nodes, given.name)
    if len(found) != 1:
        names = [f'{node.key}/{name}' for node in nodes for name in node.sources]
        message = f"the system has no source '{given.name}'"
        if found:
            message = f"{len(found)} nodes have a source '{given.name}'"
            names = [f'{node.key}/{name}' for node, name in found]
        shown = suggest_full_name(given.name, names, 'write one of')
        yield context.at_key(given.path, _SOURCE, message, help=shown)
        return
    node, name = found[0]
    publisher = node.publishers.get(node.sources[name].publish or '')
    if publisher is None:
        message = f"source '{name}' of '{node.name}' has no 'publish': its values go nowhere"
        help_text = "put another object in the place of its device with 'replace'"
        yield context.at_key(given.path, _SOURCE, message, help=help_text)
        return
    description = context.describe(publisher.type)
    if isinstance(description, MessageDescription):
        for value in given.values:
            yield from check_message(context, description, (*value.path, 'value'))
    if given.recording is not None:
        ends = context.system.topology.channels.values()
        topic = next(
            channel.name
            for channel in ends
            if any(end.path == publisher.path for end in channel.providers)
        )
        yield from check_recorded(context, given.recording, given.path, topic)


def _check_object(
    context: ScenarioContext, name: str, at: Callable[..., Diagnostic]
) -> Iterator[Diagnostic]:
    """Check that there is an object that is called `module:name`."""
    module_name, _, path = name.partition(':')
    module = context.system.modules.find(module_name)
    if isinstance(module, MissingModule):
        message = f"there is no module '{module.missing}'"
        help_text = did_you_mean(module.nearest)
        yield at('unknown-behaviour', message, help=help_text)
        return
    first = path.partition('.')[0]
    known = {*module.functions, *module.constants, *module.imports}
    is_open = module.is_open or _SETS_NAMES.search(module.content or b'')
    owner = module.functions.get(first)
    if first not in known and not is_open:
        message = f"'{first}' is not in the module '{module_name}'"
        yield at('unknown-behaviour', message, help=suggest(first, known, 'it has'))
    elif owner and owner.class_definition and path != first and not module.find_function(path):
        yield at('unknown-behaviour', f"there is no '{path}' in the module '{module_name}'")


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
