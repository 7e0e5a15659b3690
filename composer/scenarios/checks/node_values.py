"""Checks of what a scenario file says of nodes: their parameters, states and names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.checks.parameters import OF_EVERY_NODE, find_nearest_choice, find_refusal
from composer.language.parsing.parameter_references import listed_parameters
from composer.ros_parameters.parameter_types import convert_parameter_value, find_type_problem
from composer.scenarios.checks.scenario_context import suggest_full_name
from composer.scenarios.checks.time_checks import value_at
from composer.scenarios.parsing.full_names import NameReader
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.scenarios.checks.scenario_context import ScenarioContext
    from composer.yaml_text.positions import DataPath


def find_node(context: ScenarioContext, name: str) -> NodeSpec | None:
    """Return the node that a scenario file means by a name."""
    nodes = context.system.spec.nodes
    return context.node(NameReader(nodes).node(name))


def explain_node(
    context: ScenarioContext,
    name: str,
    path: DataPath,
    *,
    at_key: bool,
    others: Iterable[str] = (),
) -> Diagnostic:
    """Return the finding for a node that the system does not have.

    Args:
        others: Names of workers, where these may be meant, too.
    """
    message = f"there is no node '{name}' in this system"
    nodes, listed = context.system.spec.nodes, 'its nodes are'
    if '/' in name:
        full_names = [node.full_name for node in nodes.values()]
        help_text = suggest_full_name(name, full_names, listed)
    else:
        help_text = suggest(name, [*nodes, *others], listed)
    at = context.at_key if at_key else context.at_value
    return at(path, 'unknown-node', message, help=help_text)


def check_given_parameters(
    context: ScenarioContext, path: DataPath, *, may_be_refused: bool = False
) -> Iterator[Diagnostic]:
    """Check parameters by nodes: that they are declared, and take these values.

    Args:
        may_be_refused: Whether the values need not fit.
    """
    for name, values in (value_at(context, path) or {}).items():
        node = find_node(context, name)
        if node is None:
            yield explain_node(context, name, (*path, name), at_key=True)
            continue
        for parameter, value in values.items():
            at = (*path, name, parameter)
            declared = node.parameters.get(parameter)
            if declared is None:
                yield from _check_undeclared(context, node, parameter, at)
            elif not may_be_refused and parameter in listed_parameters(node):
                message = f"entities are repeated for the values of '{parameter}'"
                help_text = 'give it in a layer of the system: the file is read with its values'
                yield context.at_key(at, 'refused-parameter', message, help=help_text)
            elif not may_be_refused:
                yield from _check_value(context, declared, value, at)


def _check_undeclared(
    context: ScenarioContext, node: NodeSpec, name: str, path: DataPath
) -> Iterator[Diagnostic]:
    is_open = node.has_other_parameters or name in OF_EVERY_NODE
    # A behaviour may declare parameters with rclpy.
    is_open = is_open or any(each.reaches_ros for each in context.system.readings(node))
    if is_open or node.path[:2] in context.system.incomplete:
        return
    message = f"node '{node.name}' declares no parameter '{name}'"
    help_text = suggest(name, node.parameters, 'it declares')
    yield context.at_key(path, 'unknown-parameter', message, help=help_text)


def _check_value(
    context: ScenarioContext, declared: ParameterSpec, value: Any, path: DataPath
) -> Iterator[Diagnostic]:
    if declared.type is None:
        return
    converted = convert_parameter_value(value, declared.type)
    problem = find_type_problem(converted, declared.type) or find_refusal(declared, converted)
    if problem:
        message = f"parameter '{declared.name}': {problem}"
        near = find_nearest_choice(declared, value)
        yield context.at_value(path, 'refused-parameter', message, help=near)


def check_node_name(context: ScenarioContext, path: DataPath) -> Iterator[Diagnostic]:
    """Check the name of a node that stands at a path; `*` is any."""
    name = value_at(context, path)
    if name != '*' and find_node(context, name) is None:
        yield explain_node(context, name, path, at_key=False)


def check_states(context: ScenarioContext, path: DataPath) -> Iterator[Diagnostic]:
    """Check that nodes with states have a lifecycle."""
    for name in value_at(context, path):
        node = find_node(context, name)
        if node is None:
            yield explain_node(context, name, (*path, name), at_key=True)
        elif node.lifecycle is None:
            message = f"node '{node.name}' has no lifecycle, and no state"
            yield context.at_key((*path, name), 'no-lifecycle', message)
