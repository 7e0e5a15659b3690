"""Walk the body of a function and track on which conditions each place is reached."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.local_names import depends_on_file, list_arguments

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from composer.python_source.syntax import FunctionNode

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


class ControlFlowVisitor(ast.NodeVisitor):
    """Walks the body of a function, and tracks the conditions of the current place.

    Its methods yield the nodes to visit, each of which is visited before the method goes on: no
    function is too deep for it.

    Args:
        node_name: The parameter that is the node.
        local: All names of the function itself.
        chosen: Those of them whose values a file sets.
        called: The inner functions that the function itself calls (`find_inner_calls`).

    Attributes:
        doubts: The number of conditions around the place that depend on the file.
        guards: The number of statements around it that catch the error of an unknown name.
        depth: The number of inner functions around it.
    """

    def __init__(
        self, node_name: str, local: set[str], chosen: set[str], called: Collection[str]
    ) -> None:
        self.node_name = node_name
        self.local = local
        self.doubts = 0
        self.guards = 0
        self.depth = 0
        self._chosen = chosen
        self._called = called
        self._jumps = 0

    def visit_all(self, nodes: Iterable[ast.AST]) -> None:
        """Visit nodes, and all that is in them."""
        visits = [iter(nodes)]
        while visits:
            node = next(visits[-1], None)
            if node is None:
                visits.pop()
                continue
            self._jumps += isinstance(node, _JUMPS)
            visit = getattr(self, f'visit_{type(node).__name__}', ast.iter_child_nodes)
            visits.append(iter(visit(node) or ()))

    def visit_If(self, node: ast.If) -> Iterator[ast.AST]:
        """A condition that depends on the file makes its branches uncertain.

        After a jump in a branch, all that follows is uncertain too.
        """
        yield from self._visit_choice(node.test, [*node.body, *node.orelse])

    def visit_While(self, node: ast.While) -> Iterator[ast.AST]:
        """See `visit_If`."""
        yield from self._visit_choice(node.test, [*node.body, *node.orelse], is_loop=True)

    def visit_For(self, node: ast.For) -> Iterator[ast.AST]:
        """See `visit_If`."""
        yield from self._visit_choice(node.iter, [*node.body, *node.orelse], is_loop=True)

    def visit_Match(self, node: ast.Match) -> Iterator[ast.AST]:
        """See `visit_If`."""
        guards = [case.guard for case in node.cases if case.guard]
        yield from self._visit_choice(
            node.subject, [*guards, *(s for c in node.cases for s in c.body)]
        )

    def visit_IfExp(self, node: ast.IfExp) -> Iterator[ast.AST]:
        """See `visit_If`."""
        yield from self._visit_choice(node.test, [node.body, node.orelse])

    def visit_BoolOp(self, node: ast.BoolOp) -> Iterator[ast.AST]:
        """See `visit_If`."""
        yield from self._visit_choice(node.values[0], node.values[1:])

    def visit_Assert(self, node: ast.Assert) -> Iterator[ast.AST]:
        """See `visit_If`."""
        yield node.test
        self.doubts += depends_on_file(node.test, self.node_name, self._chosen)

    def visit_Try(self, node: ast.Try) -> Iterator[ast.AST]:
        """A handler that catches the error of an unknown name guards the body."""
        is_guard = any(_catches(handler) for handler in node.handlers)
        self.guards += is_guard
        yield from node.body
        self.guards -= is_guard
        yield from (*node.handlers, *node.orelse, *node.finalbody)

    def visit_With(self, node: ast.With) -> Iterator[ast.AST]:
        """`suppress` guards the body."""
        is_guard = any(_suppresses(item.context_expr) for item in node.items)
        self.guards += is_guard
        yield from ast.iter_child_nodes(node)
        self.guards -= is_guard

    def visit_FunctionDef(self, node: ast.FunctionDef) -> Iterator[ast.AST]:
        """An inner function may run later, or never."""
        yield from self._visit_nested(
            node, node.args, node.body, is_called=node.name in self._called
        )

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> Iterator[ast.AST]:
        """See `visit_FunctionDef`."""
        yield from self._visit_nested(
            node, node.args, node.body, is_called=node.name in self._called
        )

    def visit_Lambda(self, node: ast.Lambda) -> Iterator[ast.AST]:
        """See `visit_FunctionDef`."""
        yield from self._visit_nested(node, node.args, [node.body])

    def _visit_choice(
        self, test: ast.expr, branches: Iterable[ast.AST], *, is_loop: bool = False
    ) -> Iterator[ast.AST]:
        yield test
        is_chosen = depends_on_file(test, self.node_name, self._chosen)
        is_chosen |= not is_loop and self._is_constant(test)
        self.doubts += is_chosen
        before = self._jumps
        yield from branches
        if is_chosen and self._jumps == before:
            self.doubts -= 1

    def _is_constant(self, test: ast.expr) -> bool:
        """Return whether a test depends on nothing in the function, as a constant."""
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
        is_called: bool = False,
    ) -> Iterator[ast.AST]:
        yield from (*arguments.defaults, *filter(None, arguments.kw_defaults))
        yield from getattr(node, 'decorator_list', ())
        if any(argument.arg == self.node_name for argument in list_arguments(arguments)):
            return
        self.depth += not is_called
        yield from body
        self.depth -= not is_called


def find_inner_calls(function: FunctionNode) -> set[str]:
    """Return the names of the inner functions that the function itself calls (and awaits)."""
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


def _suppresses(context: ast.expr) -> bool:
    names = (getattr(each, 'id', '') or getattr(each, 'attr', '') for each in ast.walk(context))
    return any('suppress' in name for name in names)


def _catches(handler: ast.ExceptHandler) -> bool:
    if handler.type is None:
        return True
    caught = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    names = {
        each.attr if isinstance(each, ast.Attribute) else getattr(each, 'id', None)
        for each in caught
    }
    return bool(names & (_CATCHING | {None}))
