"""The names in a function: its parameters, its variables, and those whose values a file sets."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.python_source.syntax import FunctionNode


_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_IMPORTS = (ast.Import, ast.ImportFrom)
_SINGLE_ASSIGNMENTS = (ast.AnnAssign, ast.AugAssign, ast.NamedExpr)
_LOOPS = (ast.For, ast.AsyncFor, ast.comprehension)


def find_parameter(function: FunctionNode, position: int | str) -> str | None:
    """Return the name of a parameter by its position or keyword."""
    arguments = function.args
    positional = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
    if isinstance(position, int):
        return positional[position] if position < len(positional) else None
    named = [argument.arg for argument in (*arguments.args, *arguments.kwonlyargs)]
    return position if position in named else None


def list_arguments(arguments: ast.arguments) -> Iterator[ast.arg]:
    """Yield all parameters, `*args` and `**kwargs` included."""
    yield from (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    yield from filter(None, (arguments.vararg, arguments.kwarg))


def stored_names(nodes: Iterable[ast.AST]) -> Iterator[ast.Name]:
    """Yield each place among nodes where a name is assigned or deleted."""
    for node in nodes:
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node


def nested_names(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the names that inner functions, classes, imports and handlers define."""
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, _DEFINITIONS):
            names.add(node.name)
        elif isinstance(node, _IMPORTS):
            names |= {(item.asname or item.name).partition('.')[0] for item in node.names}
        elif isinstance(node, ast.ExceptHandler) and node.name:
            names.add(node.name)
    return names


def find_chosen(nodes: Iterable[ast.AST], node_name: str, chosen: set[str]) -> set[str]:
    """Return the names whose values a file sets, and those computed from them."""
    found = set(chosen)
    targets_of: dict[str, list[ast.expr]] = {}
    pending: list[str] = list(chosen)
    for target, value in _assignments(nodes):
        if depends_on_file(value, node_name, chosen):
            pending += _names_in(target)
        else:
            for name in _names_in(value):
                targets_of.setdefault(name, []).append(target)
    while pending:
        name = pending.pop()
        found.add(name)
        for target in targets_of.pop(name, ()):
            pending += _names_in(target)
    return found


def _names_in(expression: ast.expr) -> set[str]:
    return {each.id for each in ast.walk(expression) if isinstance(each, ast.Name)}


def depends_on_file(expression: ast.expr, node_name: str, chosen: set[str]) -> bool:
    """Return whether an expression depends on the file: on the node or on a chosen name."""
    for node in ast.walk(expression):
        if isinstance(node, ast.Name) and node.id in chosen:
            return True
        is_of_node = isinstance(node, ast.Attribute) and is_name(node.value, node_name)
        if is_of_node and node.attr in ('name', 'parameters', 'ros'):  # type: ignore[attr-defined]
            return True
    return False


def _assignments(nodes: Iterable[ast.AST]) -> Iterator[tuple[ast.expr, ast.expr]]:
    for node in nodes:
        if isinstance(node, ast.Assign):
            yield from ((target, node.value) for target in node.targets)
        elif isinstance(node, _SINGLE_ASSIGNMENTS):
            if node.value is not None:
                yield node.target, node.value
        elif isinstance(node, _LOOPS):
            yield node.target, node.iter
        elif isinstance(node, ast.withitem) and node.optional_vars is not None:
            yield node.optional_vars, node.context_expr


def is_name(node: ast.AST, name: str) -> bool:
    """Return whether an expression is this name, and nothing else."""
    return isinstance(node, ast.Name) and node.id == name
