"""Checks of the topics, services and actions that a scenario file names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.scenarios.checks.time_checks import value_at
from composer.scenarios.specs import PublishStepSpec
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import ChannelKind
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.scenarios.specs import CaseSpec
    from composer.yaml_text.positions import DataPath

_KINDS = {'topic': 'msg', 'service': 'srv', 'action': 'action'}
_UNKNOWN = {
    'topic': 'unknown-topic',
    'service': 'unknown-service',
    'action': 'unknown-action',
}
_NOUNS = {'topic': 'message', 'service': 'service', 'action': 'action'}


def is_known(context: ScenarioContext, kind: ChannelKind, name: str) -> bool:
    """Return whether the system has a topic, service or action, or may have it."""
    if context.channel(kind, name) or context.is_of_ros(kind, name):
        return True
    return any(context.may_have(kind, name, provides=each) for each in (True, False))


def explain_unknown(
    context: ScenarioContext, kind: ChannelKind, name: str, path: DataPath, case: str = ''
) -> Diagnostic:
    """Return the finding for a name that the system does not have.

    Args:
        case: When it may be there all the same, and only its type is missing.
    """
    meant = context.suggest_channel(kind, name)
    if case:
        is_near = (meant or '').startswith('did you mean')
        advice = f"write its 'type' if {case}"
        meant = f'{meant} Otherwise {advice}' if is_near else advice
    return context.at_value(
        path,
        _UNKNOWN[kind],
        f"the system has no {kind} '{name}'",
        help=meant,
    )


def explain_left_out(
    context: ScenarioContext, kind: ChannelKind, name: str, *, provides: bool
) -> str | None:
    """Return the help if it is an external process that has the end that nodes lack."""
    channel = context.channel(kind, name)
    ends = (channel.providers if provides else channel.users) if channel else []
    if not ends:
        return None
    return f'{ends[0].owner} does, but external processes are left out'


def check_type(
    context: ScenarioContext, kind: ChannelKind, name: str, path: DataPath
) -> Iterator[Diagnostic]:
    """Check the type that a scenario gives: that it exists, and is that of the system."""
    given = value_at(context, (*path, 'type'))
    if given is None:
        return
    at = (*path, 'type')
    known = context.type_of(kind, name)
    if known is not None and known != given:
        message = f"'{name}' is a {known} in the system, not a {given}"
        yield context.at_value(at, 'conflicting-types', message, help="remove 'type'")
        return
    package, of_kind, short = given.split('/')
    if of_kind != _KINDS[kind]:
        message = (
            f'expected a {_NOUNS[kind]} type, as in package/{_KINDS[kind]}/Name; got {given!r}'
        )
        yield context.at_value(at, 'bad-value', message)
        return
    catalogue = context.catalogue
    if not catalogue.available or catalogue.has(given):
        return
    packages = catalogue.packages()
    if package not in packages:
        message = f"no interface package '{package}' is installed"
        help_text = suggest(package, packages)
        yield context.at_value(at, 'unknown-type', message, part=package, help=help_text)
        return
    names = [each.rpartition('/')[2] for each in catalogue.names(of_kind, package)]
    message = f"the package '{package}' has no {_NOUNS[kind]} '{short}'"
    help_text = suggest(short, names, f'its {_NOUNS[kind]}s are')
    yield context.at_value(at, 'unknown-type', message, part=short, help=help_text)


def publishes_itself(case: CaseSpec, topic: str) -> bool:
    """Return whether a case publishes on a topic: a step, or its recording."""
    if any(isinstance(each, PublishStepSpec) and each.topic == topic for each in case.steps):
        return True
    return case.given.recording is not None
