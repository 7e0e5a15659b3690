"""Find out whether a function always returns a value."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.annotations import dotted_name
from composer.python_source.syntax import is_none, own_nodes, positional_names, stored_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.python_source.syntax import FunctionNode

# Expressions whose value is never `None`.
_VALUES = (
    *(ast.BinOp, ast.Compare, ast.Dict, ast.DictComp, ast.JoinedStr, ast.List, ast.ListComp),
    *(ast.Tuple, ast.UnaryOp),
)
# What never returns.
_EXITS = {
    *('_exit', 'abort', 'assert_never', 'execl', 'execv', 'execve', 'execvp', 'exit', 'fail'),
    'quit',
}
_ENDLESS = {'count', 'cycle', 'repeat'}
_TESTS_OF_TYPES = {'callable', 'hasattr', 'isinstance', 'issubclass', 'ok'}
# What goes through something that has an end.
_FINITE = {
    *('enumerate', 'items', 'keys', 'len', 'list', 'max', 'min', 'open', 'range', 'reversed'),
    *('set', 'sorted', 'split', 'splitlines', 'tuple', 'values', 'zip'),
}
# Handlers of these run when the process, or the task, ends.
_AT_THE_END = ('CancelledError', 'GeneratorExit', 'KeyboardInterrupt', 'Shutdown', 'SystemExit')
_CONVERSIONS = {'abs', 'bool', 'dict', 'float', 'int', 'len', 'list', 'round', 'str', 'sum'}


def always_answers(function: FunctionNode) -> bool:
    """Return whether every path through a function returns a value that cannot be `None`.

    The second parameter, a message, is such a value, and so are its fields.
    """
    message = _message_of(function)
    sure = set() if message in stored_names(function) else {message}
    if any(isinstance(node, ast.Raise | ast.Continue) for node in ast.walk(function)):
        return False
    has_end = _Ways(function).lead_past(function.body)
    return not has_end and all(_is_value(each.value, sure) for each in _returns(function))


def _message_of(function: FunctionNode) -> str:
    return next(iter(positional_names(function)[1:]), '')


def _returns(function: FunctionNode) -> list[ast.Return]:
    return [node for node in own_nodes(function) if isinstance(node, ast.Return)]


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


def ends_without_value(
    function: FunctionNode, is_last: Callable[[ast.Call], bool]
) -> list[ast.AST]:
    """Return where a function ends without a value, on ways that are there for certain.

    Where no way gives a value, any way that may end is one.

    Args:
        is_last: Whether a call never returns; others have the names of such functions.
    """
    is_certain = any(not is_none(answer.value) for answer in _returns(function))
    ways = _Ways(function, is_last, is_certain=is_certain)
    has_end = ways.lead_past(function.body)
    return [*ways.bare, *([function] if has_end else [])]


def never_returns(function: FunctionNode) -> bool:
    """Return whether a function always raises, or is said to."""
    if dotted_name(function.returns).rpartition('.')[2] in ('NoReturn', 'Never'):
        return True
    return not any(_returns(function)) and not _Ways(function).lead_past(function.body)


class _Ways:
    """The ways through a function.

    Two tests of one thing may leave no way past both: `if x: return 1` and `elif not x: return 2`.

    Args:
        is_certain: Whether only ways count that are there for certain, not all there may be.

    Attributes:
        bare: The `return` without a value that some way comes to.
    """

    def __init__(
        self,
        function: FunctionNode,
        is_last: Callable[[ast.Call], bool] = lambda _: False,
        *,
        is_certain: bool = False,
    ) -> None:
        self.bare: list[ast.expr | ast.Return] = []
        self._message = _message_of(function)
        self._is_last = is_last
        self._is_certain = is_certain
        self._tested: set[str] = set()
        # How the loop around a statement is left.
        self._jumps: set[type[ast.stmt]] = set()
        self._sources: dict[str, set[str]] = {}
        for node in ast.walk(function) if is_certain else ():
            if isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr) and node.value:
                subjects = self._subjects(node.value)
                for name in stored_names(node):
                    self._sources.setdefault(name, set()).update(subjects)

    def lead_past(self, block: list[ast.stmt]) -> bool:
        """Return whether a way comes to the end of a block."""
        return all(self._is_past(statement) for statement in block)

    def _is_past(self, statement: ast.stmt) -> bool:
        match statement:
            case ast.Return():
                self.bare += [statement.value or statement] if is_none(statement.value) else []
            case ast.Break() | ast.Continue():
                self._jumps.add(type(statement))
            case ast.Raise() | ast.Assert(test=ast.Constant(value=False | 0)):
                pass
            case ast.Expr(value=(ast.Call() as call) | ast.Await(value=ast.Call() as call)):
                return _last_name(call.func) not in _EXITS and not self._is_last(call)
            case ast.If():
                return self._is_past_if(statement)
            case ast.With() | ast.AsyncWith():
                is_left = any('suppress' in ast.dump(item) for item in statement.items)
                return self.lead_past(statement.body) or is_left
            case ast.For() | ast.AsyncFor() | ast.While():
                return self._is_past_loop(statement)
            case ast.Match():
                return self._is_past_match(statement)
            case ast.Try() | ast.TryStar():
                handlers = [each.body for each in statement.handlers if not self._is_rare(each)]
                blocks = ([*statement.body, *statement.orelse], *handlers)
                past = [self.lead_past(block) for block in blocks]
                return self.lead_past(statement.finalbody) and any(past)
            case _:
                return True
        return False

    def _is_past_if(self, node: ast.If) -> bool:
        may_fail, before = self._may_fail(node.test), self._tested
        within = self._tested = before | self._subjects(node.test)
        body = self.lead_past(node.body)
        other = may_fail and self.lead_past(node.orelse)
        if body and other and self._tested == within:
            # Where both branches come here, nothing is known of the test.
            self._tested = before
        return body or other

    def _is_past_match(self, node: ast.Match) -> bool:
        self._tested = self._tested | self._subjects(node.subject)
        past = [self.lead_past(case.body) for case in node.cases]
        texts = [getattr(case.pattern, 'value', None) for case in node.cases]
        match node.cases[-1]:
            case ast.match_case(ast.MatchAs(None) | ast.MatchOr([*_, ast.MatchAs(None)]), None):
                return any(past)
        is_open = all(self._is_one_text(node.subject, text) for text in texts)
        return any(past) or is_open or not self._is_certain

    def _is_rare(self, handler: ast.ExceptHandler) -> bool:
        caught = ast.dump(handler.type) if handler.type else ''
        return self._is_certain and any(name in caught for name in _AT_THE_END)

    def _is_past_loop(self, node: ast.For | ast.AsyncFor | ast.While) -> bool:
        source = node.test if isinstance(node, ast.While) else node.iter
        before, jumps = self._tested, self._jumps
        # Which round is the last may be tested by what the loop stores.
        self._tested = before | self._subjects(source) | stored_names(node)
        self._jumps = set()
        is_past = self.lead_past(node.body) or ast.Continue in self._jumps
        is_broken, self._jumps = ast.Break in self._jumps, jumps
        called = {_last_name(each.func) for each in ast.walk(source) if isinstance(each, ast.Call)}
        if not self._is_certain:
            is_past = True
        elif not called <= _FINITE:
            is_past = False
        elif self._is_given(source) or 'open' in called:
            # It may have no round.
            is_past, self._tested = True, before
        elif dotted_name(source) in self._sources:
            is_past = False
        is_over = is_past and not _is_endless(node)
        return (is_over and self.lead_past(node.orelse)) or is_broken

    def _may_fail(self, test: ast.expr) -> bool:
        """Return whether a test may be false, whatever was tested before."""
        parts: list[ast.expr] = []
        match test:
            case ast.Constant(value):
                return not value
            case ast.Compare(left, [ast.Eq()], [other]) if self._is_one_text(left, other):
                return True
            case ast.BoolOp(ast.Or(), parts):
                pass
        if not self._is_certain:
            return True
        # It may name all that there are.
        subjects = [subject for part in parts for subject in self._subjects(part)]
        is_whole = len(subjects) > len(set(subjects)) or any(
            (isinstance(node, ast.Call) and _last_name(node.func) in _TESTS_OF_TYPES)
            or (
                isinstance(node, ast.Compare)
                and any(isinstance(operator, ast.In) for operator in node.ops)
                and not self._is_given(node.left)
            )
            for node in ast.walk(test)
        )
        return not is_whole and not self._is_tested(test)

    def _is_one_text(self, tested: ast.expr, text: object) -> bool:
        """Return whether something in the message is tested for a text: it may be another."""
        is_text = isinstance(text, ast.Constant) and isinstance(text.value, str)
        return is_text and self._is_given(tested)

    def _is_given(self, expression: ast.expr) -> bool:
        """Return whether a value is of the message, which may be any."""
        subjects = self._subjects(expression)
        return any(subject.startswith(f'{self._message}.') for subject in subjects)

    def _is_tested(self, expression: ast.expr) -> bool:
        """Return whether something of an expression, or that it is a part of, was tested."""
        return any(
            f'{one}.'.startswith(f'{two}.') or two.startswith(f'{one}.')
            for one in self._subjects(expression)
            for two in self._tested
        )

    def _subjects(self, expression: ast.expr) -> set[str]:
        """Return what a value depends on: fields of the message, parameters, and objects."""
        subjects: set[str] = set()
        pending: list[ast.AST] = [expression]
        while pending:
            node = pending.pop()
            if isinstance(node, ast.Call):
                pending += [*node.args, *node.keywords]
                if isinstance(node.func, ast.Attribute):
                    pending.append(node.func.value)
                elif not (node.args or node.keywords):
                    # Functions without arguments may all read one thing.
                    subjects.add('()')
            elif isinstance(node, ast.Name | ast.Attribute) and (name := dotted_name(node)):
                root = name.partition('.')[0]
                is_whole = root == self._message or '.parameters.' in name
                subjects |= {name if is_whole else root, *self._sources.get(root, ())}
            else:
                pending.extend(ast.iter_child_nodes(node))
        return subjects


def _is_endless(loop: ast.For | ast.AsyncFor | ast.While) -> bool:
    """Return whether only its body ends a loop."""
    if isinstance(loop, ast.While):
        return isinstance(loop.test, ast.Constant) and bool(loop.test.value)
    return isinstance(loop.iter, ast.Call) and _last_name(loop.iter.func) in _ENDLESS


def _last_name(called: ast.expr) -> str:
    return dotted_name(called).rpartition('.')[2] or getattr(called, 'attr', '?')
