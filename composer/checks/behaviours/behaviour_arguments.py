"""Arguments under `with:` that can have no effect, as another part of the node shows.

`behaviours.topics:mux` passes messages on while the parameter `selected` is its `source`: never,
if that is not among the parameter's choices. What `behaviours.monitor` watches has to be counted.
"""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.checks.behaviours.transforms import is_shipped
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import positional_names, stored_names
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import BehaviourSpec, NodeSpec, ParameterSpec
    from composer.python_source.syntax import FunctionNode

_MONITOR = 'behaviours.monitor'
_WATCHING = ('watch', 'diagnose')


def check_compared_arguments(context: CheckContext) -> Iterator[Diagnostic]:
    """Check arguments that are compared with parameters against their choices."""
    pairs: dict[str, set[tuple[str, str]]] = {}
    for node in context.spec.nodes.values():
        if not any(parameter.choices for parameter in node.parameters.values()):
            continue
        for behaviour in (binding.behaviour for binding in context.bindings(node)):
            if behaviour.arguments and behaviour.name not in pairs:
                module = context.modules.find(behaviour.module)
                name = behaviour.function
                source = module.find_function(name) if isinstance(module, ModuleSource) else None
                function = source.definition if source else None
                pairs[behaviour.name] = _compared_pairs(function) if function else set()
            for argument, name in sorted(pairs.get(behaviour.name, ())):
                parameter, value = node.parameters.get(name), behaviour.arguments.get(argument)
                if value is None or not parameter or not parameter.choices:
                    continue
                if value not in parameter.choices and _is_known(context, parameter):
                    yield context.at_value(
                        (*behaviour.path[:-1], 'with', argument),
                        'bad-argument',
                        f"{behaviour.function} compares '{argument}' with the parameter '{name}', "
                        f'which is never {value!r}',
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
    stored = stored_names(function)
    own = {*positional_names(function)[:1]} - stored
    pairs: set[tuple[str, str]] = set()
    for node in ast.walk(function):
        match node:
            case ast.Compare(left=left, ops=[ast.Eq()], comparators=[right]):
                for one, other in ((left, right), (right, left)):
                    match one, other:
                        case (
                            ast.Attribute(ast.Attribute(ast.Name(owner), 'parameters'), name),
                            ast.Name(argument),
                        ) if owner in own and argument not in stored:
                            pairs.add((argument, name))
    return pairs


def check_monitors(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that for each topic that is watched, the same node counts messages."""
    for node in context.spec.nodes.values():
        if node.path not in context.incomplete:
            yield from _check_monitors_of(context, node)


def _check_monitors_of(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    behaviours = [binding.behaviour for binding in context.bindings(node)]
    watching = [
        each
        for each in behaviours
        if (each.module == _MONITOR and each.function in _WATCHING) and 'topic' in each.arguments
    ]
    if not watching or not is_shipped(context, _MONITOR):
        return
    if any(_may_count(context, each) for each in behaviours):
        # Others may call its functions themselves.
        return
    topics = [each.arguments.get('topic') for each in behaviours if each.function == 'count']
    otherwise = f"bind '{_MONITOR}:count' to a subscription, with the same 'topic'"
    for behaviour in watching:
        topic = behaviour.arguments['topic']
        if topic is not None and topic not in topics:
            yield context.at_value(
                (*behaviour.path[:-1], 'with', 'topic'),
                'bad-argument',
                f"nothing in node '{node.name}' counts the messages of '{topic}'",
                help=suggest(topic, topics, 'it counts', otherwise),
            )


def _may_count(context: CheckContext, behaviour: BehaviourSpec) -> bool:
    """Return whether a behaviour of another module may call those of the monitor."""
    if is_shipped(context, behaviour.module):
        return False
    module = context.modules.find(behaviour.module)
    if not isinstance(module, ModuleSource) or module.is_open or module.unread:
        return True
    is_named = any('monitor' in line for line in module.lines)
    # What it imports may import it.
    return is_named or any(context.modules.is_of_project(each) for each in module.imports.values())
