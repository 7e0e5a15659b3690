"""Names of nodes, namespaces, topics and parameters follow ROS's rules."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.confidential import conceal
from composer.diagnostics import Related
from composer.language.specs import DeclaredNodeSpec, NodeSpec
from composer.names import (
    MAX_TOPIC_NAME,
    expand_name,
    find_namespace_problem,
    find_node_name_problem,
    find_parameter_name_problem,
    find_topic_name_problem,
    with_article,
)
from composer.python_source.modules import ModuleSource
from composer.spelling import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ComponentSpec, ProcessSpec
    from composer.yaml_text.positions import DataPath

_RULE = 'bad-name'
# What is wrong with a name that is only for people to read.
IS_EMPTY = 'reports could not show it'

# By the keys of a node that turn them on.
_LONGEST_OWN_SERVICES = {
    'parameter_services': 'set_parameters_atomically',
    'type_description_service': 'get_type_description',
    'logger_services': 'get_logger_levels',
}


def check_names(context: CheckContext) -> Iterator[Diagnostic]:
    """Check every name that ROS gets."""
    yield from _check_namespaces(context)
    yield from _check_interface_packages(context)
    for node in context.spec.nodes.values():
        problem = find_node_name_problem(node.name)
        if problem:
            message = f"'{node.name}' cannot name a node: {problem}"
            help_text = _suggest_underscores(node.name, find_node_name_problem)
            yield context.at_key(node.path, _RULE, message, help=help_text)
        else:
            yield from _check_own_services(context, node)
        yield from _check_ros_names(context, node)
        for parameter in node.parameters.values():
            problem = find_parameter_name_problem(parameter.name)
            if problem:
                yield context.at_key(parameter.path, _RULE, f"'{parameter.name}': {problem}")
        yield from check_rules(context, node)
    for process in context.spec.processes.values():
        for declared in process.nodes:
            yield from _check_declared(context, declared)


def _check_interface_packages(context: CheckContext) -> Iterator[Diagnostic]:
    for package in context.spec.interfaces:
        if context.modules.is_of_project(package):
            module = context.modules.find(package)
            path = module.path if isinstance(module, ModuleSource) else None
            yield context.at_key(
                ('interfaces', package),
                _RULE,
                f"'{package}': Python finds '{path}' before the interface package",
                help='remove this file, or give it another name',
            )


def _check_declared(context: CheckContext, node: DeclaredNodeSpec) -> Iterator[Diagnostic]:
    """Check the names in what an external process is said to have."""
    is_apart = node.path[-1] != node.process
    is_component = node.path[-2:-1] == ('components',)
    if is_apart and not is_component and (problem := find_node_name_problem(node.name)):
        message = f"'{node.name}' cannot name a node: {problem}"
        yield context.at_key(node.path, _RULE, message)
        return
    for kind, end in node.ends():
        yield from _check_ros_name(context, node, end.path, str(kind.channel), end.channel)
    for parameter in node.parameters.values() if is_apart else ():
        problem = find_parameter_name_problem(parameter.name)
        if problem:
            yield context.at_key(parameter.path, _RULE, f"'{parameter.name}': {problem}")


def _check_namespaces(context: CheckContext) -> Iterator[Diagnostic]:
    reported: set[DataPath] = set()
    for node in context.spec.nodes.values():
        problem = find_namespace_problem(node.namespace)
        own = (*node.path, 'namespace')
        path = own if own in context.system.positions.values else ('defaults', 'namespace')
        if str(node.path[-1]).startswith('/'):
            path = node.path
        if problem and path not in reported:
            reported.add(path)
            say = context.at_key if path == node.path else context.at_value
            related = [*_find_outer_namespace(context, path)]
            help_text = _suggest_underscores(node.namespace, find_namespace_problem)
            message = f"'{node.namespace}': {problem}"
            yield say(path, _RULE, message, help=help_text, related=related)


def _suggest_underscores(name: str, find_problem: Callable[[str], str | None]) -> str | None:
    """Return the help for a name with hyphens, spaces or dots, or with a slash at its end."""
    if conceal(f"'{name}'") != f"'{name}'":
        # The name itself would show what is hidden.
        return "replace what is not allowed, as in {{ name | replace('-', '_') }}"
    meant = re.sub('[-. ]', '_', name).rstrip('/')
    return did_you_mean(None if find_problem(meant) else meant)


def _find_outer_namespace(context: CheckContext, path: DataPath) -> Iterator[Related]:
    """Yield where the namespace is written that the one at a path lies in, if it is."""
    positions, outer = context.system.positions, ('defaults', 'namespace')
    is_inner = path in context.system.notes and positions.value(path) != positions.value(outer)
    if is_inner and outer in positions.values and path[:2] not in context.system.chains:
        yield context.related_value(outer, 'it lies in this one')


def check_full_names(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no two nodes have the same full name."""
    first: dict[str, NodeSpec | ComponentSpec] = {}
    spec = context.spec
    nodes: list[NodeSpec | ComponentSpec] = [*spec.nodes.values()]
    nodes += [component for component in spec.components if component.is_named]
    named = {name: process for process in spec.processes.values() for name in process.named_nodes}
    yield from _check_names_of_processes(context)
    for node in nodes:
        other = first.setdefault(node.full_name, node)
        if other is not node and not _are_misplaced(context, node, other):
            yield context.at_key(
                node.path,
                'duplicate-node',
                f"a node '{node.full_name}' already exists",
                help="give one of them another name, or a 'namespace'",
                related=[Related('the other one', context.system.positions.key(other.path))],
            )
        process = named.get(node.full_name)
        if process is not None and not _are_misplaced(context, node):
            yield context.at_value(
                (*process.path, 'name'),
                'duplicate-node',
                f"a node '{node.full_name}' already exists",
                help="give one of them another name, or a 'namespace'",
                related=[Related('the other one', context.system.positions.key(node.path))],
            )


def _check_names_of_processes(context: CheckContext) -> Iterator[Diagnostic]:
    """Report nodes of two processes that run at the same time."""
    first: dict[str, ProcessSpec] = {}
    for process in context.spec.processes.values():
        for name in process.named_nodes:
            other = first.setdefault(name, process)
            is_alone = other is process or process.on_demand or other.on_demand
            if is_alone or _follows(process, other) or _follows(other, process):
                continue
            yield context.at_value(
                (*process.path, 'name'),
                'duplicate-node',
                f"a node '{name}' already exists",
                help="give one of them another name, or a 'namespace'",
                related=[context.related_value((*other.path, 'name'), 'the other one')],
            )


def _follows(process: ProcessSpec, other: ProcessSpec) -> bool:
    """Return whether one waits until the other has ended."""
    return any(each.kind == 'process' and each.name == other.name for each in process.wait_for)


def _are_misplaced(context: CheckContext, *nodes: NodeSpec | ComponentSpec) -> bool:
    """Return whether the namespace of a node is unknown because of an error."""
    owners = (('defaults',), *(node.path for node in nodes))
    return any(context.was_dropped((*owner, 'namespace')) for owner in owners)


def _check_own_services(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    """Check the length of the names of a node's own services."""
    for key, service in _LONGEST_OWN_SERVICES.items():
        private = f'~/{service}'
        if getattr(node, key) and _find_full_name_problem(node, private):
            length = len(expand_name(private, node.name, node.namespace))
            message = (
                f"the node's service '{private}' has {length} characters in full, "
                f'and ROS allows {MAX_TOPIC_NAME}'
            )
            help_text = f"shorten the node's name, or write '{key}: false'"
            yield context.at_key(node.path, _RULE, message, help=help_text)


def _check_ros_names(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    for kind, entity in node.entities():
        is_a_ros_name = kind.section == 'parameters' or (
            kind.channel is not None
            and ((*entity.path, kind.channel) not in context.system.positions.values)
        )
        if not entity.name.strip() and not is_a_ros_name:
            message = f"'{entity.name}' cannot name {with_article(kind.noun)}: {IS_EMPTY}"
            yield context.at_key(entity.path, _RULE, message)
    for kind, entity in node.ends():
        channel = str(kind.channel)
        yield from _check_ros_name(context, node, entity.path, channel, getattr(entity, channel))


def _check_ros_name(
    context: CheckContext,
    node: NodeSpec | DeclaredNodeSpec,
    entity: DataPath,
    kind: str,
    name: str,
) -> Iterator[Diagnostic]:
    problem = find_topic_name_problem(name, kind) or _find_full_name_problem(node, name, kind)
    if not problem:
        return
    message = f"'{name}' cannot name {with_article(kind)}: {problem}"
    path = (*entity, kind)
    if path in context.system.positions.values:
        help_text = _suggest_underscores(name, find_topic_name_problem)
        yield context.at_value(path, _RULE, message, help=help_text)
    else:
        otherwise = f"give its name with '{kind}:', and let this be a plain word"
        help_text = _suggest_underscores(name, find_topic_name_problem) or otherwise
        yield context.at_key(entity, _RULE, message, help=help_text)


def _find_full_name_problem(
    node: NodeSpec | DeclaredNodeSpec, topic: str, kind: str = 'topic'
) -> str | None:
    """Return the error of a name in its namespace, such as its length."""
    if find_node_name_problem(node.name) or find_namespace_problem(node.namespace):
        return None
    full = expand_name(topic, node.name, node.namespace)
    # An action's name is the beginning of those of its topics and services.
    longest = f'{full}/_action/cancel_goal' if kind == 'action' else full
    problem = find_topic_name_problem(longest)
    return problem and f"in full it is '{longest}', and {problem}"


def check_rules(
    context: CheckContext, node: NodeSpec | ProcessSpec | ComponentSpec
) -> Iterator[Diagnostic]:
    """Check the remapping rules of a node, or of the nodes in a process."""
    for source, target in node.remap:
        path = (*node.path, 'remap', source)
        if source.startswith('__'):
            key = {'__node': 'the key of the node', '__ns': "'namespace:'"}.get(source)
            help_text = f'use {key} instead' if key else None
            message = f"'{source}' is not remapped here"
            yield context.at_key(path, 'bad-remap', message, help=help_text)
            continue
        scheme, separator, bare = source.rpartition('://')
        if separator and scheme not in ('rostopic', 'rosservice'):
            message = f"'{scheme}://' is not a scheme of remapping rules"
            yield context.at_key(path, 'bad-remap', message, help='rostopic:// or rosservice://')
            continue
        for name, at in ((bare, context.at_key), (target, context.at_value)):
            problem = _find_rule_name_problem(name)
            if problem is None and isinstance(node, NodeSpec):
                problem = _find_full_name_problem(node, name)
            if problem:
                yield at(path, _RULE, f"'{name}' cannot be used in a remapping rule: {problem}")


def _find_rule_name_problem(name: str) -> str | None:
    """Return why a rule cannot have a name; rcl's lexer takes fewer names than topics do."""
    if '{' in name:
        return 'it has no substitutions'
    if name == '~':
        return "'~' needs a slash after it"
    return find_topic_name_problem(name)
