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


def is_name(node: ast.AST, name: str) -> bool:
    """Return whether an expression is this name, and nothing else."""
    return isinstance(node, ast.Name) and node.id == name
