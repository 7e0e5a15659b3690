"""The places in a module of which a report of a type checker says nothing certain.

An error there may be caught, asked for before, or never come, as a value of the file decides.
"""

from __future__ import annotations

import ast
import itertools
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from composer.python_source.syntax import FUNCTIONS, SCOPES, list_children, owner_of, words_in
from composer.records import record

if TYPE_CHECKING:
    from composer.node_uses.walk import Places
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import AnnotatedCopy
    from composer.stubs.checking.type_checker import TypeReport

# What asks what a value is.
_TESTS = frozenset({'hasattr', 'isinstance', 'issubclass', 'callable', 'type'})
# What has no places of its own, and what is no value that can be asked for.
_NOT_ASKED = (ast.JoinedStr, ast.Lambda, ast.arguments, ast.pattern, ast.stmt)
_NOT_VALUES = (
    *(ast.Constant, ast.Dict, ast.Lambda, ast.List, ast.NamedExpr, ast.Set, ast.Slice),
    *(ast.Starred, ast.Tuple, ast.Yield, ast.YieldFrom),
)
# What may catch errors of what is in it, or hold for some types alone.
_CATCHING = (ast.Match, ast.Try, ast.TryStar, ast.With)


@record
class ReportedPlace:
    """The syntax at the place of a report, and whether it is left alone."""

    copy: AnnotatedCopy
    report: TypeReport
    places: Places

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
    def whole(self) -> list[ast.expr]:
        """The expressions that are just where the report is."""
        line = self.report.end_line
        end = line, self.copy.original_column(line, self.report.end_column)
        return [each for each in self.values if self.copy.end(each) == end]

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
    def parts(self) -> list[ast.expr]:
        """The values in the statement that the report is in, or in its head."""
        inner = next((each for each in self.around if isinstance(each, ast.stmt)), None)
        heads = [] if inner is None else list_children(inner)
        pending = [each for each in heads if not isinstance(each, ast.stmt)]
        # Whose attribute is missing; other parts of a chain have to stay together, for what is
        # known of the whole.
        is_missing = self.report.kind == 'missing-attribute'
        named = [each for each in self.values if isinstance(each, ast.Attribute)]
        found: list[ast.expr] = [each.value for each in named if is_missing]
        while pending:
            node = pending.pop()
            if isinstance(node, ast.Call):
                pending += [*node.args, *node.keywords, *list_children(node.func)]
            elif not isinstance(node, _NOT_ASKED) and not _is_chain(node):
                pending += list_children(node)
            is_read = isinstance(getattr(node, 'ctx', ast.Load()), ast.Load)
            if isinstance(node, ast.expr) and is_read and not isinstance(node, _NOT_VALUES):
                found.append(node)
        return found

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
        if not chain or self._standing[0]:
            return True
        asked = _asked_in(function) if function else frozenset()
        inner = next((i for i, node in enumerate(chain) if isinstance(node, ast.stmt)), 0)
        part = chain[max(0, inner - 1)] if hasattr(chain[inner], 'body') else chain[inner]
        names = {node.id for node in ast.walk(part) if isinstance(node, ast.Name)}
        return bool(names & asked)

    @property
    def is_chosen_by_file(self) -> bool:
        """Whether only the file decides whether what the report is about is reached."""
        return self._standing[1]

    @property
    def depends_on_file(self) -> bool:
        """Whether it may be reached only as the file has decided before."""
        return self._standing[2]

    @cached_property
    def _standing(self) -> tuple[bool, bool, bool]:
        """As of a `Walk`; what no behaviour comes to is left alone on any condition."""
        inside = [*itertools.takewhile(lambda node: not isinstance(node, SCOPES), self.around)]
        known = [self.places[id(node)] for node in inside if id(node) in self.places]
        if known:
            return known[0]
        is_caught = any(isinstance(node, _CATCHING) for node in inside)
        tests = [
            getattr(node, 'test', None) or getattr(node, 'values', [None])[0] for node in inside
        ]
        words = words_in(*(test for test in tests if isinstance(test, ast.expr)))
        return is_caught, bool(words & (_TESTS | {'parameters', 'name'})), True


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


def _is_chain(node: ast.AST) -> bool:
    return isinstance(node, ast.expr) and isinstance(owner_of(node), ast.Name)
