"""Which nodes and messages the functions of a project are given: by Composer, and by each other.

A parameter counts as known only if everything that it is given is known.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from composer.language.bindings import node_bindings
from composer.node_uses.values import Chain
from composer.python_source.syntax import FUNCTIONS, list_arguments, stored_names
from composer.stubs.project_modules import all_nodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.node_uses.reading import Wire
    from composer.node_uses.values import Value
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.project_modules import ProjectModule

FunctionKey: TypeAlias = tuple[str, str]


@dataclass(slots=True)
class Received:
    """What a parameter is given.

    Attributes:
        nodes: The keys of nodes.
        messages: The full names of messages.
        is_open: Whether it may be given something else.
    """

    nodes: dict[str, None] = field(default_factory=dict)
    messages: dict[str, None] = field(default_factory=dict)
    is_open: bool = False


@dataclass(slots=True)
class FunctionUse:
    """A function at the top level of a module or class, and what is known of its use.

    Attributes:
        received: By parameter.
        bindings: The places that it is bound to, with the types around it.
        is_called: Whether the project itself calls or passes it.
    """

    definition: FunctionNode
    received: dict[str, Received] = field(default_factory=dict)
    bindings: list[tuple[Binding, Wire]] = field(default_factory=list)
    is_called: bool = False

    def give(self, name: str, value: Value | None, node: NodeSpec, wire: Wire) -> None:
        """Note what a parameter is given by a behaviour of a node."""
        received = self.received.setdefault(name, Received())
        if value == Chain(('node',)):
            received.nodes[node.key] = None
        elif value == Chain(('message',)) and wire.given:
            received.messages[wire.given] = None
        else:
            received.is_open = True


def find_received_values(
    context: CheckContext, modules: Mapping[str, ProjectModule]
) -> dict[FunctionKey, FunctionUse]:
    """Return the functions of a project that are given nodes or messages, by module and name."""
    functions = {
        (name, f'{owner}{function.name}'): FunctionUse(function)
        for name, module in modules.items()
        for owner, body in _scopes(module)
        for function in body
        if isinstance(function, FUNCTIONS) and not function.decorator_list
    }
    by_definition = {id(use.definition): use for use in functions.values()}
    for node in all_nodes(context):
        for binding in node_bindings(node):
            behaviour, wire = binding.behaviour, context.behaviours.wire_of(node, binding)
            bound = functions.get((behaviour.module, behaviour.function))
            if bound is not None:
                bound.bindings.append((binding, wire))
            for passed in context.behaviours.read(node, binding).passed:
                use = by_definition.get(id(passed.definition))
                if use is not None:
                    use.is_called |= passed.is_call
                    for name, value in passed.given.items():
                        use.give(name, value, node, wire)
    return functions


def _scopes(module: ProjectModule) -> Iterator[tuple[str, list[ast.stmt]]]:
    yield '', module.tree.body
    for top in module.tree.body:
        if isinstance(top, ast.ClassDef):
            yield f'{top.name}.', top.body


def changed_names(function: FunctionNode) -> set[str]:
    """Return the names that a function assigns, and the parameters of functions inside it."""
    functions = (each for each in ast.walk(function) if isinstance(each, (*FUNCTIONS, ast.Lambda)))
    inner = {
        each.arg
        for node in functions
        if node is not function
        for each in list_arguments(node.args)
    }
    return stored_names(function) | inner
