"""Find out whether a function always returns a value."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.annotations import dotted_name
from composer.python_source.syntax import is_none, own_nodes, positional_names, stored_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.python_source.syntax import FunctionNode

# What was tested on a way; `None` if there is no way.
_Tested = frozenset[str] | None
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
    return _ends(function) and all(_is_value(each.value, sure) for each in _returns(function))


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
    has_value = any(not is_none(answer.value) for answer in _returns(function))
    ways = _Ways(function, is_last, is_certain=has_value)
    is_end = ways.follow(function.body, frozenset()) is not None
    return [*ways.bare, *([function] if is_end else [])]


def never_returns(function: FunctionNode) -> bool:
    """Return whether a function always raises, or is said to."""
    said = dotted_name(function.returns) if function.returns is not None else ''
    if str(said).rpartition('.')[2] in ('NoReturn', 'Never'):
        return True
    return not any(_returns(function)) and _ends(function)


def _ends(function: FunctionNode) -> bool:
    """Return whether no way through a function comes to its end: all return or raise."""
    return _Ways(function, is_certain=False).follow(function.body, frozenset()) is None


class _Ways:
    """The ways through a function, each with what was tested on it.

    Two tests of one thing may leave no way past both: `if x: return 1` and `elif not x: return 2`.

    Args:
        is_certain: Whether to follow only ways that are there for certain, not all there may be.

    Attributes:
        bare: The `return` without a value that some way comes to.
    """

    def __init__(
        self,
        function: FunctionNode,
        is_last: Callable[[ast.Call], bool] = lambda _: False,
        *,
        is_certain: bool,
    ) -> None:
        self.bare: list[ast.expr | ast.Return] = []
        self._message = _message_of(function)
        self._is_last = is_last
        self._is_certain = is_certain
        self._continued: list[_Tested] = []
        self._broken: list[_Tested] = []
        self._sources: dict[str, set[str]] = {}
        for node in ast.walk(function) if is_certain else ():
            if isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr) and node.value:
                subjects = self._subjects(node.value)
                for name in stored_names(node):
                    self._sources.setdefault(name, set()).update(subjects)

    def follow(self, block: list[ast.stmt], tested: _Tested) -> _Tested:
        """Return what was tested on the way to the end of a block; `None` if there is no way."""
        for statement in block:
            if tested is None:
                break
            tested = self._past(statement, tested)
        return tested

    def _past(self, statement: ast.stmt, tested: frozenset[str]) -> _Tested:
        match statement:
            case ast.Return():
                self.bare += [statement.value or statement] if is_none(statement.value) else []
            case ast.Break() | ast.Continue():
                is_break = isinstance(statement, ast.Break)
                (self._broken if is_break else self._continued).append(tested)
            case ast.Raise() | ast.Assert(test=ast.Constant(value=False | 0)):
                pass
            case ast.Expr(value=(ast.Call() as call) | ast.Await(value=ast.Call() as call)):
                is_exit = _last_name(call.func) in _EXITS
                return None if is_exit or self._is_last(call) else tested
            case ast.If():
                return self._past_if(statement, tested)
            case ast.With() | ast.AsyncWith():
                is_left = any('suppress' in ast.dump(item) for item in statement.items)
                return _join(self.follow(statement.body, tested), tested if is_left else None)
            case ast.For() | ast.AsyncFor() | ast.While():
                return self._past_loop(statement, tested)
            case ast.Match():
                return self._past_match(statement, tested)
            case ast.Try() | ast.TryStar():
                return self._past_try(statement, tested)
            case _:
                return tested
        return None

    def _past_if(self, node: ast.If, tested: frozenset[str]) -> _Tested:
        within = tested | self._subjects(node.test)
        body = self.follow(node.body, within)
        other = self.follow(node.orelse, within if self._may_fail(node.test, tested) else None)
        # Where both branches come here, nothing is known of the test.
        return tested if body == other == within else _join(body, other)

    def _past_match(self, node: ast.Match, tested: frozenset[str]) -> _Tested:
        within = tested | self._subjects(node.subject)
        ends = [self.follow(case.body, within) for case in node.cases]
        texts = [getattr(case.pattern, 'value', None) for case in node.cases]
        is_past = all(self._is_one_text(node.subject, text) for text in texts)
        match node.cases[-1]:
            case ast.match_case(ast.MatchAs(None) | ast.MatchOr([*_, ast.MatchAs(None)]), None):
                return _join(*ends)
        return _join(*ends, within if is_past or not self._is_certain else None)

    def _past_try(self, node: ast.Try | ast.TryStar, tested: frozenset[str]) -> _Tested:
        ends = [self.follow(node.orelse, self.follow(node.body, tested))]
        for handler in node.handlers:
            caught = ast.dump(handler.type) if handler.type else ''
            is_rare = self._is_certain and any(name in caught for name in _AT_THE_END)
            ends.append(self.follow(handler.body, None if is_rare else tested))
        is_left = self.follow(node.finalbody, tested) is not None
        return _join(*ends) if is_left else None

    def _past_loop(
        self, node: ast.For | ast.AsyncFor | ast.While, tested: frozenset[str]
    ) -> _Tested:
        source = node.test if isinstance(node, ast.While) else node.iter
        before = self._continued, self._broken
        self._continued, self._broken = [], []
        # Which round is the last may be tested by what the loop stores.
        stored = stored_names(node)
        body = self.follow(node.body, tested | self._subjects(source) | stored)
        body, broken = _join(body, *self._continued), self._broken
        self._continued, self._broken = before
        past = None if _is_endless(node) else tested
        if self._is_certain and past is not None:
            past = self._past_source(source, tested, body)
        return _join(self.follow(node.orelse, past), *broken)

    def _past_source(self, source: ast.expr, tested: frozenset[str], body: _Tested) -> _Tested:
        """Return what was tested where a loop is certain to end: without a round, or after one."""
        calls = [node.func for node in ast.walk(source) if isinstance(node, ast.Call)]
        names = {_last_name(call) for call in calls}
        if not names <= _FINITE:
            return None
        is_maybe_empty = self._is_given(source) or 'open' in names
        return tested if is_maybe_empty else None if dotted_name(source) in self._sources else body

    def _may_fail(self, test: ast.expr, tested: frozenset[str]) -> bool:
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
        is_double = len(subjects) > len(set(subjects)) and not _are_of_several(parts)
        is_whole = is_double or any(
            (isinstance(node, ast.Call) and _last_name(node.func) in _TESTS_OF_TYPES)
            or (
                isinstance(node, ast.Compare)
                and any(isinstance(operator, ast.In) for operator in node.ops)
                and not self._is_given(node.left)
            )
            for node in ast.walk(test)
        )
        return not is_whole and not self._is_tested(test, tested)

    def _is_one_text(self, tested: ast.expr, text: object) -> bool:
        """Return whether something in the message is tested for a text: it may be another."""
        is_text = isinstance(text, ast.Constant) and isinstance(text.value, str)
        return is_text and self._is_given(tested)

    def _is_given(self, expression: ast.expr) -> bool:
        """Return whether a value is of the message, which may be any."""
        subjects = self._subjects(expression)
        return any(subject.startswith(f'{self._message}.') for subject in subjects)

    def _is_tested(self, expression: ast.expr, tested: frozenset[str]) -> bool:
        """Return whether something of an expression, or that it is a part of, was tested."""
        return any(
            f'{one}.'.startswith(f'{two}.') or two.startswith(f'{one}.')
            for one in self._subjects(expression)
            for two in tested
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


def _are_of_several(tests: list[ast.expr]) -> bool:
    """Return whether tests are of several names that one call may give: `a > 2 or b > 2`."""
    compared = [each for each in tests if isinstance(each, ast.Compare)]
    names = {each.left.id for each in compared if isinstance(each.left, ast.Name)}
    ways = {type(each.ops[0]) for each in compared}
    return len(names) == len(tests) and len(ways) == 1 and ways <= {ast.Gt, ast.Lt}


def _is_endless(loop: ast.For | ast.AsyncFor | ast.While) -> bool:
    """Return whether only its body ends a loop."""
    if isinstance(loop, ast.While):
        return isinstance(loop.test, ast.Constant) and bool(loop.test.value)
    return isinstance(loop.iter, ast.Call) and _last_name(loop.iter.func) in _ENDLESS


def _last_name(called: ast.expr) -> str:
    return dotted_name(called).rpartition('.')[2] or getattr(called, 'attr', '?')


def _join(*ends: _Tested) -> _Tested:
    """Return what was tested on any of several ways; `None` if there is no way."""
    ways = [end for end in ends if end is not None]
    return frozenset().union(*ways) if ways else None
