"""The names in a function: its parameters, its variables, and those whose values a file sets."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.modules import FunctionNode


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


def stored_names(function: FunctionNode) -> Iterator[ast.Name]:
    """Yield each place where a name is assigned or deleted."""
    for statement in function.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
                yield node


def nested_names(function: FunctionNode) -> set[str]:
    """Return the names that inner functions, classes, imports and handlers define."""
    names: set[str] = set()
    for statement in function.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                names.add(node.name)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                names |= {(item.asname or item.name).partition('.')[0] for item in node.names}
            elif isinstance(node, ast.ExceptHandler) and node.name:
                names.add(node.name)
    return names


def find_chosen(function: FunctionNode, node_name: str, chosen: set[str]) -> set[str]:
    """Return the names whose values a file sets, and those computed from them."""
    found = set(chosen)
    pairs = [pair for statement in function.body for pair in _assignments(statement)]
    while True:
        before = len(found)
        for target, value in pairs:
            if depends_on_file(value, node_name, found):
                found |= {name.id for name in ast.walk(target) if isinstance(name, ast.Name)}
        if len(found) == before:
            return found


def depends_on_file(expression: ast.expr, node_name: str, chosen: set[str]) -> bool:
    """Return whether an expression depends on the file: on the node or on a chosen name."""
    for node in ast.walk(expression):
        if isinstance(node, ast.Name) and node.id in chosen:
            return True
        is_of_node = isinstance(node, ast.Attribute) and is_name(node.value, node_name)
        if is_of_node and node.attr in ('name', 'parameters', 'ros'):  # type: ignore[attr-defined]
            return True
    return False


def _assignments(statement: ast.stmt) -> Iterator[tuple[ast.expr, ast.expr]]:
    for node in ast.walk(statement):
        if isinstance(node, ast.Assign):
            yield from ((target, node.value) for target in node.targets)
        elif isinstance(node, ast.AnnAssign | ast.AugAssign | ast.NamedExpr):
            if node.value is not None:
                yield node.target, node.value
        elif isinstance(node, ast.For | ast.AsyncFor | ast.comprehension):
            yield node.target, node.iter
        elif isinstance(node, ast.withitem) and node.optional_vars is not None:
            yield node.optional_vars, node.context_expr


def is_name(node: ast.AST, name: str) -> bool:
    """Return whether an expression is this name, and nothing else."""
    return isinstance(node, ast.Name) and node.id == name
