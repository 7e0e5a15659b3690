"""The places in a module of which a report of a type checker says nothing certain.

An error there may be caught, asked for before, or never come, as a value of the file decides.
"""

from __future__ import annotations

import ast
import itertools
from functools import cached_property
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import AnnotatedCopy
    from composer.stubs.checking.type_checker import TypeReport

# What asks for an attribute that may not be there, or makes it.
_ASKING = frozenset({'hasattr', 'getattr', 'setattr', 'delattr'})
# What asks what a value is.
_TESTS = frozenset({'hasattr', 'isinstance', 'issubclass', 'callable', 'type'})
# What a missing name raises, and what these errors are.
_CAUGHT = frozenset(
    {
        'AttributeError',
        'BaseException',
        'ComposerError',
        'Exception',
        'KeyError',
        'LookupError',
        'PayloadError',
        'TypeError',
        'UndeclaredError',
        'UndeclaredParameterError',
    }
)
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_BRANCHES = (ast.If, ast.IfExp, ast.While, ast.Match, ast.BoolOp, ast.Assert)
# What a node has in one system and not in another.
_OF_FILE = frozenset({'parameters', 'name'})


@record
class LeftAlone:
    """Finds the syntax at places of a copy, and the places that are left alone."""

    copy: AnnotatedCopy

    def at(self, report: TypeReport) -> list[ast.AST]:
        """Return the syntax nodes that begin where a report is, outermost first."""
        column = self.copy.original_column(report.line, report.column)
        return self._nodes.get((report.line, column), [])

    def around(self, report: TypeReport) -> list[ast.AST]:
        """Return the syntax nodes that a report is in, innermost first."""
        found = self.at(report) or [
            node
            for (line, column), nodes in self._nodes.items()
            for node in nodes
            if (line, column) <= (report.line, self._column(report))
            and (report.line, self._column(report)) <= self.end(node)
        ]
        if not found:
            return []
        # Of those that begin together, the inner ones come last.
        _, _, node = max((self.start(each), index, each) for index, each in enumerate(found))
        chain = [node]
        while (above := self._parents.get(id(chain[-1]))) is not None:
            chain.append(above)
        return chain

    def start(self, node: ast.AST) -> tuple[int, int]:
        """Return the line and the column at which a statement or an expression begins."""
        line, offset = getattr(node, 'lineno', 1), getattr(node, 'col_offset', 0)
        return line, self._characters(line, offset)

    def end(self, node: ast.AST) -> tuple[int, int]:
        """Return the line and the column after the last character."""
        line, offset = getattr(node, 'end_lineno', 1), getattr(node, 'end_col_offset', 0)
        return line, self._characters(line, offset)

    def lines(self, report: TypeReport) -> range:
        """Return the lines of the statement that a report is in, or of its head."""
        statement = next(
            (each for each in self.around(report) if isinstance(each, ast.stmt)), None
        )
        if statement is None or hasattr(statement, 'body'):
            return range(report.line, report.line + 1)
        return range(statement.lineno, (statement.end_lineno or statement.lineno) + 1)

    def is_left_alone(self, report: TypeReport) -> bool:
        """Return whether what a report is about may be caught, asked for, or never come."""
        chain = self.around(report)
        if not chain or any(id(node) in self._guarded for node in chain):
            return True
        function = self.function(report)
        names = {node.id for node in self._expression(chain) if isinstance(node, ast.Name)}
        asked = self._asked_in(function) if function else frozenset()
        return bool(names & asked) or any(map(_depends_on_file, _branches(chain)))

    def depends_on_file(self, report: TypeReport) -> bool:
        """Return whether a report comes after a branch that ends its function as the file says.

        Of a branch with the report in it, `is_left_alone` knows.
        """
        function = self.function(report)
        if function is None:
            return True
        extra = {each.arg for each in (*function.args.args[2:], *function.args.kwonlyargs)}
        chain = self.around(report)
        tests = {id(node) for node in chain} - {id(node) for node in _branches(chain)}
        inside = {id(node) for node in _branches(chain)}
        return any(
            isinstance(node, _BRANCHES)
            and self.start(node)[0] <= report.line
            and (_depends_on_file(node) or extra & {*_names(*_test(node))})
            and (id(node) in inside or (id(node) not in tests and _may_end(node)))
            for node in ast.walk(function)
        )

    def function(self, report: TypeReport) -> FunctionNode | None:
        """Return the function that a report is in."""
        return next((node for node in self.around(report) if isinstance(node, _FUNCTIONS)), None)

    def is_asked_for(self, name: str) -> bool:
        """Return whether the module asks for an attribute or a key, or makes it."""
        return name.startswith('_') or name in self._asked

    def _column(self, report: TypeReport) -> int:
        return self.copy.original_column(report.line, report.column)

    def _characters(self, line: int, offset: int) -> int:
        lines = self.copy.module.source.lines
        text = lines[line - 1] if line <= len(lines) else ''
        return len(text.encode()[:offset].decode(errors='replace')) + 1

    def _expression(self, chain: list[ast.AST]) -> Iterator[ast.AST]:
        """Yield the parts of the statement that a report is in, or of the head of one."""
        inner: ast.AST | None = None
        for node in chain:
            if isinstance(node, ast.stmt):
                yield from ast.walk(inner if inner is not None and hasattr(node, 'body') else node)
                return
            inner = node

    @cached_property
    def _parents(self) -> dict[int, ast.AST]:
        return {
            id(child): node
            for node in ast.walk(self.copy.module.tree)
            for child in ast.iter_child_nodes(node)
        }

    @cached_property
    def _asked(self) -> frozenset[str]:
        return frozenset(
            argument.value
            for node in ast.walk(self.copy.module.tree)
            for argument in _asked_names(node)
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
        )

    @cached_property
    def _guarded(self) -> frozenset[int]:
        """The syntax nodes whose errors the module itself catches, or that may never run."""
        return frozenset(
            id(inner)
            for node in ast.walk(self.copy.module.tree)
            for guarded in _guarded_nodes(node)
            for inner in ast.walk(guarded)
        )

    @cached_property
    def _nodes(self) -> dict[tuple[int, int], list[ast.AST]]:
        places: dict[tuple[int, int], list[ast.AST]] = {}
        for node in ast.walk(self.copy.module.tree):
            if isinstance(node, ast.expr | ast.stmt):
                places.setdefault(self.start(node), []).append(node)
        return places

    def _asked_in(self, function: ast.AST) -> frozenset[str]:
        """Return the names of which a function asks what they are."""
        return frozenset(
            name
            for node in ast.walk(function)
            if isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in _TESTS
            for name in _names(*node.args)
        )


def _branches(chain: list[ast.AST]) -> Iterator[ast.AST]:
    """Yield the branches that decide whether the innermost node of a chain is reached."""
    for inner, node in itertools.pairwise(chain):
        is_first = inner in (getattr(node, 'test', None), getattr(node, 'subject', None))
        is_first |= isinstance(node, ast.BoolOp) and inner is node.values[0]
        if isinstance(node, _BRANCHES) and not is_first:
            yield node


def _depends_on_file(branch: ast.AST) -> bool:
    return any(map(_is_of_file, _test(branch)))


def _is_of_file(test: ast.AST) -> bool:
    """Return whether the file alone may decide on a condition, or on a part of one."""
    if isinstance(test, ast.Attribute) and test.attr in _OF_FILE:
        return True
    children = [each for each in ast.iter_child_nodes(test) if not isinstance(each, ast.Constant)]
    if isinstance(test, ast.Call) and isinstance(test.func, ast.Name):
        children.remove(test.func)
    # A value of the run beside one of the file: both outcomes may come.
    is_joined = isinstance(test, ast.Compare | ast.BinOp | ast.Call)
    operands = [each for each in children if isinstance(each, ast.expr | ast.keyword)]
    if is_joined:
        return bool(operands) and all(map(_is_of_file, operands))
    return any(map(_is_of_file, children))


def _may_end(branch: ast.AST) -> bool:
    ends = (ast.Return, ast.Raise, ast.Break, ast.Continue)
    return isinstance(branch, ast.Assert) or any(isinstance(n, ends) for n in ast.walk(branch))


def _test(branch: ast.AST) -> list[ast.AST]:
    if isinstance(branch, ast.BoolOp):
        return [*branch.values[:-1]]
    if isinstance(branch, ast.Match):
        return [branch.subject]
    test = getattr(branch, 'test', None)
    return [test] if isinstance(test, ast.AST) else []


def _asked_names(node: ast.AST) -> list[ast.expr]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _ASKING:
        return node.args
    if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn):
        return [node.left]
    return []


def _guarded_nodes(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Try | ast.TryStar) and any(map(_catches, node.handlers)):
        yield from node.body
    elif isinstance(node, ast.With | ast.AsyncWith):
        calls = [item.context_expr for item in node.items]
        names = {name for call in calls if isinstance(call, ast.Call) for name in _names(call)}
        if names & {'suppress', 'raises'}:
            yield from node.body
    elif isinstance(node, ast.If) and _is_fixed(node.test):
        yield from (*node.body, *node.orelse)
    elif isinstance(node, ast.IfExp) and _is_fixed(node.test):
        yield from (node.body, node.orelse)


def _is_fixed(test: ast.expr) -> bool:
    """Return whether a condition may hold always or never: a constant, or an identity."""
    if isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is | ast.IsNot):
        other = test.comparators[0]
        is_member = isinstance(other, ast.Attribute) and other.attr.isupper()
        return not (isinstance(other, ast.Constant) or is_member)
    if isinstance(test, ast.Constant):
        return True
    return isinstance(test, ast.Name) and (test.id.isupper() or test.id == '__debug__')


def _catches(handler: ast.ExceptHandler) -> bool:
    return handler.type is None or bool(_CAUGHT & set(_names(handler.type)))


def _names(*expressions: ast.AST) -> Iterator[str]:
    for expression in expressions:
        for node in ast.walk(expression):
            if isinstance(node, ast.Name):
                yield node.id
            elif isinstance(node, ast.Attribute):
                yield node.attr
