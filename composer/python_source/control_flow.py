"""The way to each place of a function: what has to be so for it to be reached."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.local_names import hangs_on, list_arguments

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from composer.python_source.modules import FunctionNode

# What `node.publish('x')` raises for a name that is not declared, and what catches it.
_CATCHING = {
    'AttributeError',
    'BaseException',
    'ComposerError',
    'Exception',
    'KeyError',
    'LookupError',
    'UndeclaredError',
    'UndeclaredParameterError',
}
_JUMPS = (ast.Return, ast.Raise, ast.Continue, ast.Break)


class WayReader(ast.NodeVisitor):
    """Walks the body of a function, and keeps what is known of the way to the present place.

    Args:
        node_name: The parameter that is the node.
        local: All names of the function itself.
        chosen: Those of them whose values a file decides.
        run: The functions inside that the function runs to their ends (`find_run`).

    Attributes:
        doubts: On how many decisions of a file the place hangs.
        guards: How many statements around it catch what an unknown name raises.
        depth: How many functions inside the function it lies in.
    """

    def __init__(
        self, node_name: str, local: set[str], chosen: set[str], run: Collection[str]
    ) -> None:
        self.node_name = node_name
        self.local = local
        self.doubts = 0
        self.guards = 0
        self.depth = 0
        self._chosen = chosen
        self._run = run

    def visit_If(self, node: ast.If) -> None:
        """What a file decides makes both branches, and all behind a jump, uncertain."""
        self._visit_choice(node.test, [*node.body, *node.orelse])

    def visit_While(self, node: ast.While) -> None:
        """See `visit_If`."""
        self._visit_choice(node.test, [*node.body, *node.orelse], is_loop=True)

    def visit_For(self, node: ast.For) -> None:
        """See `visit_If`."""
        self._visit_choice(node.iter, [*node.body, *node.orelse], is_loop=True)

    def visit_Match(self, node: ast.Match) -> None:
        """See `visit_If`."""
        guards = [case.guard for case in node.cases if case.guard]
        self._visit_choice(node.subject, [*guards, *(s for c in node.cases for s in c.body)])

    def visit_IfExp(self, node: ast.IfExp) -> None:
        """See `visit_If`."""
        self._visit_choice(node.test, [node.body, node.orelse])

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        """See `visit_If`."""
        self._visit_choice(node.values[0], node.values[1:])

    def visit_Assert(self, node: ast.Assert) -> None:
        """See `visit_If`."""
        self.visit(node.test)
        self.doubts += hangs_on(node.test, self.node_name, self._chosen)

    def visit_Try(self, node: ast.Try) -> None:
        """Its body is guarded if a handler catches what an unknown name raises."""
        is_guard = any(_catches(handler) for handler in node.handlers)
        self.guards += is_guard
        for statement in node.body:
            self.visit(statement)
        self.guards -= is_guard
        for inner in (*node.handlers, *node.orelse, *node.finalbody):
            self.visit(inner)

    def visit_With(self, node: ast.With) -> None:
        """`suppress` is a guard."""
        is_guard = any('suppress' in ast.dump(item.context_expr) for item in node.items)
        self.guards += is_guard
        self.generic_visit(node)
        self.guards -= is_guard

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """A function inside runs when it is called, if ever."""
        self._visit_nested(node, node.args, node.body, runs=node.name in self._run)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        """See `visit_FunctionDef`."""
        self._visit_nested(node, node.args, node.body, runs=node.name in self._run)

    def visit_Lambda(self, node: ast.Lambda) -> None:
        """See `visit_FunctionDef`."""
        self._visit_nested(node, node.args, [node.body])

    def _visit_choice(
        self, test: ast.expr, branches: Iterable[ast.AST], *, is_loop: bool = False
    ) -> None:
        self.visit(test)
        is_chosen = hangs_on(test, self.node_name, self._chosen)
        is_chosen |= not is_loop and self._is_constant(test)
        self.doubts += is_chosen
        inner = list(branches)
        for branch in inner:
            self.visit(branch)
        jumps = any(isinstance(node, _JUMPS) for branch in inner for node in ast.walk(branch))
        if is_chosen and not jumps:
            self.doubts -= 1

    def _is_constant(self, test: ast.expr) -> bool:
        """Return whether a test hangs on nothing of the function: on a constant, say."""
        if isinstance(test, ast.Constant):
            return not test.value
        names = {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
        return not names & self.local

    def _visit_nested(
        self,
        node: ast.AST,
        arguments: ast.arguments,
        body: Iterable[ast.AST],
        *,
        runs: bool = False,
    ) -> None:
        for default in (*arguments.defaults, *filter(None, arguments.kw_defaults)):
            self.visit(default)
        for decorator in getattr(node, 'decorator_list', ()):
            self.visit(decorator)
        if any(argument.arg == self.node_name for argument in list_arguments(arguments)):
            return
        self.depth += not runs
        for inner in body:
            self.visit(inner)
        self.depth -= not runs


def find_run(function: FunctionNode) -> set[str]:
    """Return the names of the functions inside that the function itself runs to their ends."""
    inner = {
        each.name: isinstance(each, ast.AsyncFunctionDef)
        for each in function.body
        if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    found: set[str] = set()
    pending: list[tuple[ast.AST, bool]] = [(each, False) for each in function.body]
    while pending and inner:
        node, is_awaited = pending.pop()
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found |= {node.func.id} if inner.get(node.func.id) in (False, is_awaited) else set()
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            awaits = isinstance(node, ast.Await)
            pending += [(each, awaits) for each in ast.iter_child_nodes(node)]
    return found & inner.keys()


def _catches(handler: ast.ExceptHandler) -> bool:
    if handler.type is None:
        return True
    caught = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    names = {
        each.attr if isinstance(each, ast.Attribute) else getattr(each, 'id', None)
        for each in caught
    }
    return bool(names & (_CATCHING | {None}))
