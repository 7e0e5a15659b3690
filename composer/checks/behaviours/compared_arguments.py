"""Arguments that behaviours compare with a parameter can be equal to it.

`behaviours.topics:mux` passes messages on while the parameter `selected` is its `source`: never,
if that is not among the parameter's choices.
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.local_names import find_parameter, is_name, stored_names
from composer.python_source.modules import ModuleSource
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import BehaviourSpec, NodeSpec, ParameterSpec
    from composer.python_source.syntax import FunctionNode


def check_compared_arguments(context: CheckContext) -> Iterator[Diagnostic]:
    """Check arguments that are compared with parameters against their choices."""
    pairs: dict[str, set[tuple[str, str]]] = {}
    for node in context.spec.nodes.values():
        if not any(parameter.choices for parameter in node.parameters.values()):
            continue
        for binding in context.bindings(node):
            behaviour = binding.behaviour
            if behaviour.arguments and behaviour.name not in pairs:
                pairs[behaviour.name] = _read_pairs(context, behaviour)
            if behaviour.arguments:
                yield from _check_binding(context, node, behaviour, pairs[behaviour.name])


def _read_pairs(context: CheckContext, behaviour: BehaviourSpec) -> set[tuple[str, str]]:
    module = context.modules.find(behaviour.module)
    source = module.find_function(behaviour.function) if isinstance(module, ModuleSource) else None
    return _compared_pairs(source.definition) if source and source.definition else set()


def _check_binding(
    context: CheckContext,
    node: NodeSpec,
    behaviour: BehaviourSpec,
    pairs: set[tuple[str, str]],
) -> Iterator[Diagnostic]:
    for argument, name in sorted(pairs):
        parameter = node.parameters.get(name)
        if argument not in behaviour.arguments or not parameter or not parameter.choices:
            continue
        value = behaviour.arguments[argument]
        if value is not None and value not in parameter.choices and _is_known(context, parameter):
            yield context.at_value(
                (*behaviour.path[:-1], 'with', argument),
                'bad-argument',
                f"{behaviour.function} compares '{argument}' with the parameter '{name}', which "
                f'is never {value!r}',
                help=suggest(value, parameter.choices, 'its choices are'),
                related=[context.related(parameter.path, 'the parameter and its choices')],
            )


def _is_known(context: CheckContext, parameter: ParameterSpec) -> bool:
    """Return whether the choices of a parameter do not depend on samples."""
    path, system = parameter.path, context.system
    return not any(
        span in system.sampled and place[: len(path)] == path
        for place, span in (system.positions.values.items() if system.sampled else ())
    )


def _compared_pairs(function: FunctionNode) -> set[tuple[str, str]]:
    """Return the parameters of a function that it compares with parameters of its node."""
    node_name = find_parameter(function, 0)
    nodes = list(ast.walk(function))
    stored = {each.id for each in stored_names(nodes)}
    if node_name is None or node_name in stored:
        return set()
    compared = [
        (node.left, node.comparators[0])
        for node in nodes
        if isinstance(node, ast.Compare) and [type(each) for each in node.ops] == [ast.Eq]
    ]
    return {
        (other.id, name)
        for pair in compared
        for one, other in (pair, pair[::-1])
        if (name := _parameter_name(one, node_name))
        and isinstance(other, ast.Name)
        and other.id not in stored
    }


def _parameter_name(expression: ast.expr, node_name: str) -> str | None:
    """Return `speed` for `node.parameters.speed`."""
    if not isinstance(expression, ast.Attribute):
        return None
    owner = expression.value
    is_one = (
        isinstance(owner, ast.Attribute)
        and owner.attr == 'parameters'
        and is_name(owner.value, node_name)
    )
    return expression.attr if is_one else None
