"""The places in a module of which a report of a type checker says nothing certain.

An error there may be caught, asked for before, or never come, as a value of the file decides.
"""

from __future__ import annotations

import ast
import itertools
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from composer.python_source.syntax import FUNCTIONS, words_in
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import AnnotatedCopy
    from composer.stubs.checking.type_checker import TypeReport

# What asks what a value is.
_TESTS = frozenset({'hasattr', 'isinstance', 'issubclass', 'callable', 'type'})
# What a missing name raises, and what these errors are.
_CAUGHT = frozenset(
    {
        *('AttributeError', 'BaseException', 'ComposerError', 'Exception', 'KeyError'),
        *('LookupError', 'PayloadError', 'TypeError', 'UndeclaredError'),
        'UndeclaredParameterError',
    }
)
# What a node has in one system and not in another.
_OF_FILE = frozenset({'parameters', 'name'})


@record
class ReportedPlace:
    """The syntax at the place of a report, and whether it is left alone."""

    copy: AnnotatedCopy
    report: TypeReport

    @cached_property
    def _start(self) -> tuple[int, int]:
        line = self.report.line
        return line, self.copy.original_column(line, self.report.column)

    @property
    def nodes(self) -> list[ast.AST]:
        """The syntax nodes that begin where the report is, outermost first."""
        return self.copy.nodes.get(self._start, [])

    @property
    def values(self) -> list[ast.expr]:
        """The expressions that begin where the report is, outermost first."""
        return [node for node in self.nodes if isinstance(node, ast.expr)]

    @property
    def calls(self) -> list[ast.Call]:
        """The calls that the report is in, innermost first."""
        return [node for node in self.around if isinstance(node, ast.Call)]

    @cached_property
    def around(self) -> list[ast.AST]:
        """The syntax nodes that the report is in, innermost first."""
        start, end = self.copy.start, self.copy.end
        found = self.nodes or [
            node
            for place, nodes in self.copy.nodes.items()
            for node in nodes
            if place <= self._start <= end(node)
        ]
        if not found:
            return []
        # Of those that begin together, the inner ones come last.
        _, _, node = max((start(each), index, each) for index, each in enumerate(found))
        chain = [node]
        while (above := self.copy.parents.get(id(chain[-1]))) is not None:
            chain.append(above)
        return chain

    @property
    def function(self) -> FunctionNode | None:
        """The function that the report is in."""
        return next((node for node in self.around if isinstance(node, FUNCTIONS)), None)

    @property
    def lines(self) -> range:
        """The lines of the statement that the report is in, or of its head."""
        for node in self.around:
            if isinstance(node, ast.stmt) and not hasattr(node, 'body'):
                return range(node.lineno, (node.end_lineno or node.lineno) + 1)
            if isinstance(node, ast.stmt):
                break
        return range(self.report.line, self.report.line + 1)

    @property
    def is_left_alone(self) -> bool:
        """Whether what the report is about may be caught or asked for, or is never reached."""
        chain, function = self.around, self.function
        if not chain or any(itertools.starmap(_is_guarded, itertools.pairwise(chain))):
            return True
        asked = _asked_in(function) if function else frozenset()
        inner = next((i for i, node in enumerate(chain) if isinstance(node, ast.stmt)), 0)
        part = chain[max(0, inner - 1)] if hasattr(chain[inner], 'body') else chain[inner]
        names = {node.id for node in ast.walk(part) if isinstance(node, ast.Name)}
        return bool(names & asked)

    @property
    def is_chosen_by_file(self) -> bool:
        """Whether only the file decides whether what the report is about is reached."""
        return any(map(_is_of_file, _tests_before(self.around)))

    @property
    def depends_on_file(self) -> bool:
        """Whether the report comes after a branch that ends its function as the file says.

        Of a branch with the report in it, `is_chosen_by_file` knows.
        """
        function, around = self.function, {id(node) for node in self.around}
        if function is None:
            return True
        extra = {each.arg for each in (*function.args.args[2:], *function.args.kwonlyargs)}
        inside = {id(test) for test in _tests_before(self.around)}
        return any(
            self.copy.start(node)[0] <= self.report.line
            and (any(map(_is_of_file, tests)) or extra & words_in(*tests))
            and (inside & {*map(id, tests)} or (id(node) not in around and _may_end(node)))
            for node, tests in _branches_in(function)
        )


# Reports come a function after the other.
@lru_cache(maxsize=1)
def _asked_in(function: FunctionNode) -> frozenset[str]:
    """Return the names in what a function asks of values: what they are, or have."""
    return frozenset(
        name
        for node in ast.walk(function)
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') in _TESTS
        for name in words_in(*node.args)
    )


@lru_cache(maxsize=1)
def _branches_in(function: FunctionNode) -> list[tuple[ast.AST, list[ast.expr]]]:
    """Return the branches in a function, each with its conditions."""
    return [(node, tests) for node in ast.walk(function) if (tests := _tests_of(node))]


def _tests_of(node: ast.AST) -> list[ast.expr]:
    """Return the conditions of a branch."""
    match node:
        case ast.BoolOp(values=[*tests, _]):
            return tests
        case ast.If() | ast.IfExp() | ast.While() | ast.Assert():
            return [node.test]
        case ast.Match(subject=subject):
            return [subject]
    return []


def _may_end(branch: ast.AST) -> bool:
    ends = (ast.Return, ast.Raise, ast.Break, ast.Continue)
    return isinstance(branch, ast.Assert) or any(isinstance(n, ends) for n in ast.walk(branch))


def _tests_before(chain: list[ast.AST]) -> Iterator[ast.expr]:
    """Yield the conditions that decide whether the innermost node of a chain is reached."""
    for inner, node in itertools.pairwise(chain):
        tests = _tests_of(node)
        if inner not in tests[:1]:
            yield from tests


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


def _is_guarded(inner: ast.AST, node: ast.AST) -> bool:
    """Return whether errors in a part of a node are caught, or the part may never run."""
    match node:
        case ast.Try() | ast.TryStar():
            types = [each.type for each in node.handlers]
            return inner in node.body and (None in types or bool(_CAUGHT & words_in(*types)))
        case ast.With() | ast.AsyncWith():
            calls = [each.context_expr for each in node.items]
            names = words_in(*(each for each in calls if isinstance(each, ast.Call)))
            return inner in node.body and bool(names & {'suppress', 'raises'})
        case ast.If() | ast.IfExp():
            return inner is not node.test and _is_fixed(node.test)
    return False


def _is_fixed(test: ast.expr) -> bool:
    """Return whether a condition may hold always or never: a constant, or an identity."""
    if isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is | ast.IsNot):
        other = test.comparators[0]
        is_member = isinstance(other, ast.Attribute) and other.attr.isupper()
        return not (isinstance(other, ast.Constant) or is_member)
    if isinstance(test, ast.Constant):
        return True
    return isinstance(test, ast.Name) and (test.id.isupper() or test.id == '__debug__')
