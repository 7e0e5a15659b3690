"""Find out whether a function always returns a value, or the message that it is given."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.local_names import stored_names

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.syntax import FunctionNode

# Expressions whose value is never `None`.
_VALUES = (
    ast.BinOp,
    ast.Compare,
    ast.Dict,
    ast.DictComp,
    ast.JoinedStr,
    ast.List,
    ast.ListComp,
    ast.Tuple,
    ast.UnaryOp,
)
_CONVERSIONS = {'abs', 'bool', 'dict', 'float', 'int', 'len', 'list', 'round', 'str', 'sum'}


def always_answers(function: FunctionNode) -> bool:
    """Return whether every path through a function returns a value that cannot be `None`.

    The second parameter, a message, is such a value, and so are its fields.
    """
    arguments = [*function.args.posonlyargs, *function.args.args]
    message = arguments[1].arg if len(arguments) > 1 else ''
    stored = {
        node.id
        for node in ast.walk(function)
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)
    }
    sure = set() if message in stored else {message}
    answers = [statement.value for statement in _returns(function)]
    return _ends(function.body) and all(_is_value(answer, sure) for answer in answers)


def passes_message_on(function: FunctionNode) -> bool:
    """Return whether a function returns its second parameter, a message, as it is."""
    arguments = [*function.args.posonlyargs, *function.args.args]
    if len(arguments) <= 1:
        return False
    message = arguments[1].arg
    if any(name.id == message for name in stored_names(ast.walk(function))):
        return False
    return any(_may_be(answer.value, message) for answer in _returns(function))


def _may_be(answer: ast.expr | None, name: str) -> bool:
    if isinstance(answer, ast.IfExp):
        return _may_be(answer.body, name) or _may_be(answer.orelse, name)
    return isinstance(answer, ast.Name) and answer.id == name


def _returns(function: FunctionNode) -> Iterator[ast.Return]:
    pending: list[ast.AST] = list(function.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Return):
            yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            pending.extend(ast.iter_child_nodes(node))


def _is_value(answer: ast.expr | None, sure: set[str]) -> bool:
    if isinstance(answer, ast.Constant):
        return answer.value is not None
    if isinstance(answer, ast.Call):
        name = answer.func.id if isinstance(answer.func, ast.Name) else ''
        # A name that looks like a class makes an object.
        return name in _CONVERSIONS or name[:1].isupper()
    while isinstance(answer, ast.Attribute):
        answer = answer.value
    return isinstance(answer, _VALUES) or (isinstance(answer, ast.Name) and answer.id in sure)


def _ends(body: list[ast.stmt]) -> bool:
    """Return whether every path through a block ends with `return`."""
    pending = [body]
    while pending:
        block = pending.pop()
        last = block[-1] if block else None
        if isinstance(last, ast.If):
            pending += [last.body, last.orelse]
        elif isinstance(last, ast.With | ast.AsyncWith):
            pending.append(last.body)
        elif not isinstance(last, ast.Return):
            return False
    return True
