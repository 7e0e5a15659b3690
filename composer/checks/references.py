"""References: what an entry names: publishers, QoS profiles, interface types, programs, files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, cast

from composer.ament import explain_missing_package, has_content_filters
from composer.checks.behaviours.shipped_behaviours import is_shipped
from composer.diagnostics import diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.descriptions import MessageDescription
from composer.language.includes.include_entry import shown_path
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.language.qos import BUILTIN_PROFILES, QosError, resolve_qos
from composer.language.values.start_reader import read_from_file
from composer.programs import base_environment, find_program_problem, shell_environment
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.catalogue import InterfaceKind
    from composer.language.specs import NodeSpec, PublisherSpec, QosSpec, SubscriptionSpec
    from composer.language.values.start_values import StartValue
    from composer.yaml_text.positions import DataPath


# Behaviours that come with Composer, and publish messages as they were received.
_PASSING = frozenset(f'behaviours.topics:{name}' for name in ('drop', 'mux', 'relay', 'throttle'))
_KIND_NOUNS = {'msg': 'message', 'srv': 'service', 'action': 'action'}


def check_publish(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that `publish:` names a publisher of the node, of the same type for a relay."""
    for node in context.spec.nodes.values():
        for entity in node.triggers:
            if entity.publish is not None:
                yield from _check_publisher(context, node, entity.path, entity.publish)
        yield from _check_relays(context, node)


def _check_publisher(
    context: CheckContext, node: NodeSpec, path: DataPath, publisher: str
) -> Iterator[Diagnostic]:
    section = (*node.path, 'publishers')
    dropped = context.was_dropped((*section, publisher)) or context.was_dropped(section)
    if publisher in node.publishers or dropped:
        return
    yield context.at_value(
        (*path, 'publish'),
        'unknown-publisher',
        f"node '{node.name}' declares no publisher '{publisher}'",
        help=suggest(publisher, node.publishers, 'it declares', "declare it under 'publishers:'"),
    )


def _check_relays(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    for subscription in node.subscriptions.values():
        publisher = node.publishers.get(subscription.publish or '')
        if publisher is None or publisher.type == subscription.type:
            continue
        if not _passes_on(context, subscription, publisher):
            continue
        if all(context.has_real_type(end) for end in (subscription, publisher)):
            yield context.at_value(
                (*subscription.path, 'publish'),
                'type-mismatch',
                f"a {subscription.type} cannot be passed on to '{publisher.name}', "
                f'which publishes {publisher.type}',
                help='give both the same type, or convert in a behaviour',
            )


def _passes_on(
    context: CheckContext, subscription: SubscriptionSpec, publisher: PublisherSpec
) -> bool:
    """Return whether messages are published as they were received, and not by the project."""
    behaviour = subscription.behaviour
    if behaviour is None:
        return not context.was_dropped((*subscription.path, 'behaviour'))
    if behaviour.name not in _PASSING or not is_shipped(context, behaviour.module):
        return False
    # A message can be the only field of another one.
    published = context.catalogue.describe(publisher.type)
    if not isinstance(published, MessageDescription):
        return False
    fields = published.fields
    return len(fields) != 1 or fields[0].type.nested != subscription.type


def check_qos(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that every profile starts from a built-in one."""
    profiles = context.spec.qos
    for name, profile in profiles.items():
        if name in BUILTIN_PROFILES:
            message = f"'{name}' is a profile of ROS and cannot be declared again"
            yield context.at_key(profile.path, 'bad-name', message)
    declared: dict[DataPath, QosSpec] = {profile.path: profile for profile in profiles.values()}
    for node in context.spec.end_owners():
        for _, entity in node.ends():
            qos: QosSpec | None = getattr(entity, 'qos', None)
            if qos is not None:
                declared[qos.path] = qos
    reported: set[DataPath] = set()
    for spec in declared.values():
        try:
            resolve_qos(spec, profiles)
        except QosError as error:
            if error.spec.path not in reported:
                reported.add(error.spec.path)
                yield from _explain_qos(context, error)


def _explain_qos(context: CheckContext, error: QosError) -> Iterator[Diagnostic]:
    # Unknown profiles are dropped with the defaults of their file, or with their own entry.
    if not context.was_dropped(('qos', error.spec.profile)):
        path = context.inner(error.spec.path, 'profile')
        yield context.at_value(path, 'cyclic-qos-profile', str(error))


def check_content_filters(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the installed rclpy has content filters, if any are wanted."""
    filtered = [
        subscription
        for node in context.spec.nodes.values()
        for subscription in node.subscriptions.values()
        if subscription.content_filter
    ]
    # A file without them needs no ROS.
    if not filtered or has_content_filters() is not False:
        return
    for subscription in filtered:
        yield context.at_key(
            (*subscription.path, 'content_filter'),
            'no-content-filter',
            'this rclpy has no content filters: ROS 2 has them for Python since Kilted',
            help='let the behaviour return what it does not want',
        )


def check_types(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that every interface type is in an installed package or in one of the file's."""
    catalogue = context.catalogue
    if not catalogue.available:
        return
    for node in context.spec.end_owners():
        for _, entity in node.ends():
            package = entity.type.partition('/')[0]
            unreadable = package in context.interfaces.unreadable or any(
                context.was_dropped(path) for path in (('interfaces',), ('interfaces', package))
            )
            stands_in = context.was_dropped((*entity.path, 'type'))
            if unreadable or stands_in or context.knows_type(entity):
                continue
            path = (*entity.path, 'type')
            inner = path if path in context.system.positions.values else entity.path
            message, part, advice = describe_missing_type(context, entity.type)
            first = entity.type.startswith(f'{part}/')
            yield context.at_value(
                inner, 'unknown-type', message, part=part, first=first, help=advice
            )


def describe_missing_type(context: CheckContext, full_name: str) -> tuple[str, str, str | None]:
    """Return what is wrong with the name of a type, the part that is wrong, and help."""
    package, kind, name = full_name.split('/')
    packages = context.catalogue.packages()
    if package not in packages:
        otherwise = ", or name the folder of its definitions under 'interfaces:'"
        help_text = explain_missing_package(package, packages, otherwise)
        return f"no interface package '{package}' is installed", package, help_text
    noun = _KIND_NOUNS[kind]
    if advice := context.interfaces.explain_left_out(full_name):
        return f"'only:' of the package '{package}' leaves out its {noun} '{name}'", name, advice
    known = context.catalogue.names(cast('InterfaceKind', kind), package)
    names = [full.rpartition('/')[2] for full in known]
    advice = suggest(name, names, f'its {noun}s are')
    return f"the package '{package}' has no {noun} '{name}'", name, advice


def check_start_values(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the programs and files exist that values come from; no program is run.

    Of the files, those of the project are read.
    """
    for value in context.system.start.found:
        if value.is_elsewhere(context.spec.host):
            continue
        if value.command:
            yield from _check_command(value)
        else:
            problems = [*_check_file(value.file, value.spans[0])]
            yield from problems or _check_value(value)


def _check_value(value: StartValue) -> Iterator[Diagnostic]:
    # Files elsewhere may be others where the system runs.
    if not value.named_files or os.path.isabs(os.path.expanduser(value.file)):  # noqa: PTH111, PTH117
        return
    try:
        read_from_file(value)
    except ComposerError as error:
        yield diagnostic_at(value.spans[-1], 'bad-start-value', str(error), help=error.help)


def _check_command(value: StartValue) -> Iterator[Diagnostic]:
    program, *words = value.command
    is_here = '/' in program and not Path(program).is_absolute()
    environment = base_environment(shell_environment())
    # It runs where the system is started.
    problem = None if is_here else find_program_problem(program, Path(), environment)
    if problem:
        message, advice = problem
        yield diagnostic_at(value.spans[0], 'missing-program', message, help=advice)
    for word, span in zip(words, value.spans[1:], strict=True):
        if word.startswith('/') and Path(word).suffix and '\0' not in word:
            yield from _check_file(word, span)


def _check_file(text: str, span: Span) -> Iterator[Diagnostic]:
    try:
        path = resolve_path(text, Path())
    except PathError as error:
        yield diagnostic_at(span, 'uninstalled-package', str(error), help=error.help)
        return
    # The functions of pathlib raise for names that are too long.
    if not os.path.isfile(path):
        message = f"there is no file '{shown_path(path)}'"
        yield diagnostic_at(span, 'missing-file', message, help=explain_absent(path, span))
