"""The places in a module of which a report of a type checker says nothing certain.

An error there may be caught, asked for before, or never come, as a value of the file decides.
"""

from __future__ import annotations

import ast
import itertools
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

from composer.python_source.syntax import FUNCTIONS, SCOPES, words_in
from composer.records import record

if TYPE_CHECKING:
    from composer.node_uses.walk import Places
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.annotated_copies import AnnotatedCopy
    from composer.stubs.checking.type_checker import TypeReport

# What asks what a value is.
_TESTS = frozenset({'hasattr', 'isinstance', 'issubclass', 'callable', 'type'})
# What may not run, or catch errors of what is in it.
_CONDITIONS = (ast.If, ast.IfExp, ast.BoolOp, ast.While, ast.Match, ast.Try, ast.With)


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
        is_conditional = any(isinstance(node, _CONDITIONS) for node in inside)
        return known[0] if known else (is_conditional, is_conditional, True)


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
