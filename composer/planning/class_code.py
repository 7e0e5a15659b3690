"""The code of a class in a module, with all that it uses there: whether an edit changes it."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_IMPORTS = (ast.Import, ast.ImportFrom)
# A value of these is the same however often the module is executed, and nothing changes it.
_FIXED = (
    *(ast.Constant, ast.UnaryOp, ast.BinOp, ast.Tuple, ast.Name, ast.Attribute),
    *(ast.operator, ast.unaryop, ast.expr_context),
)
_SEES_ALL = {'globals', 'exec', 'eval', 'vars', '__import__', 'setattr', 'delattr'}


def find_class_code(source: str, name: str) -> list[ast.stmt] | None:
    """Return the statements of a module that a class depends on, the class among them.

    Returns:
        `None` if that cannot be told: if the class shares something with the rest of the module
            that may change, a class that is kept would have another one of it.
    """
    try:
        body = ast.parse(source).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    parts = [(statement, _bound(statement), _used(statement)) for statement in body]
    every = set().union(*(used for _, _, used in parts), *(bound for _, bound, _ in parts))
    if every & _SEES_ALL or '*' in every:
        return None
    wanted, chosen, rest = {name}, list[ast.stmt](), parts
    while True:
        more = [part for part in rest if part[1] & wanted or _acts_on(part, wanted)]
        if not more:
            break
        chosen += [statement for statement, _, _ in more]
        wanted = wanted.union(*(bound | used for _, bound, used in more))
        rest = [part for part in rest if part not in more]
    assigned = {
        each
        for node in ast.walk(ast.Module(body, []))
        if isinstance(node, ast.Global)
        for each in node.names
    }
    is_shared = bool(assigned & wanted) or any(name in used for _, _, used in rest)
    return None if is_shared or not _are_fixed(chosen) else chosen


def _acts_on(part: tuple[ast.stmt, set[str], set[str]], names: set[str]) -> bool:
    """Return whether a statement may do something with these names when it is executed."""
    statement, _, used = part
    return not isinstance(statement, (*_DEFINITIONS, ast.Assign, ast.AnnAssign)) and bool(
        used & names
    )


def _are_fixed(statements: Iterable[ast.stmt]) -> bool:
    return all(map(_is_fixed, statements))


def _is_fixed(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.If):
        return _are_fixed([*statement.body, *statement.orelse])
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        value = statement.value
        return value is None or all(isinstance(each, _FIXED) for each in ast.walk(value))
    return isinstance(statement, (*_DEFINITIONS, *_IMPORTS))


def _bound(statement: ast.stmt) -> set[str]:
    """Return the names that a statement of a module may give a meaning."""
    if isinstance(statement, _DEFINITIONS):
        return {statement.name}
    bound = set()
    for node in ast.walk(statement):
        if isinstance(node, _DEFINITIONS):
            bound.add(node.name)
        elif isinstance(node, _IMPORTS):
            bound |= {each.asname or each.name.partition('.')[0] for each in node.names}
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            bound.add(node.id)
    return bound


def _used(statement: ast.stmt) -> set[str]:
    return {node.id for node in ast.walk(statement) if isinstance(node, ast.Name)}
