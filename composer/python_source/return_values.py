"""Find out whether a function always returns a value, or the message that it is given."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.annotations import dotted_name
from composer.python_source.local_names import stored_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

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
_WITHOUT_RETURN = {'exit', 'quit', 'sys.exit', 'os._exit', 'os.abort'}
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
    raises = any(isinstance(node, ast.Raise | ast.Continue) for node in ast.walk(function))
    ends = not raises and _ends(function.body)
    return ends and all(_is_value(answer, sure) for answer in answers)


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


def may_return_nothing(function: FunctionNode, is_last: Callable[[ast.Call], bool]) -> bool:
    """Return whether some paths through a function return a value, and others nothing.

    Args:
        is_last: Whether a call never returns.
    """
    answers = [each.value for each in _returns(function)]
    bare = [each for each in answers if each is None]
    return len(bare) < len(answers) and bool(bare or not _ends(function.body, is_last))


def never_returns(function: FunctionNode) -> bool:
    """Return whether a function always raises, or is said to."""
    said = dotted_name(function.returns) if function.returns is not None else ''
    if str(said).rpartition('.')[2] in ('NoReturn', 'Never'):
        return True
    return not any(_returns(function)) and _ends(function.body)


def _is_exit(call: ast.Call) -> bool:
    return dotted_name(call.func) in _WITHOUT_RETURN


def _ends(body: list[ast.stmt], is_last: Callable[[ast.Call], bool] = _is_exit) -> bool:
    """Return whether no path through a block comes to its end: all return or raise."""
    last = body[-1] if body else None
    match last:
        case ast.Return() | ast.Raise() | ast.Continue():
            return True
        case ast.Expr(value=ast.Call() as call):
            return _is_exit(call) or is_last(call)
        case ast.If(body=body, orelse=orelse):
            return _ends(body, is_last) and _ends(orelse, is_last)
        case ast.With() | ast.AsyncWith():
            return _ends(last.body, is_last)
        case ast.Try(body=body, orelse=orelse, finalbody=final, handlers=handlers):
            blocks = [orelse or body, *(each.body for each in handlers)]
            ended = [_ends(each, is_last) for each in (*blocks, final)]
            return ended.pop() or all(ended)
        case ast.Match(cases=cases):
            is_whole = cases[-1].guard is None and _takes_all(cases[-1].pattern)
            return is_whole and all(_ends(each.body, is_last) for each in cases)
        case ast.While(test=ast.Constant(value=value)):
            inner = [node for node in ast.walk(last) if isinstance(node, ast.Break)]
            return bool(value) and not inner
    return False


def _takes_all(pattern: ast.pattern) -> bool:
    if isinstance(pattern, ast.MatchOr):
        return any(map(_takes_all, pattern.patterns))
    return isinstance(pattern, ast.MatchAs) and (
        pattern.pattern is None or _takes_all(pattern.pattern)
    )
