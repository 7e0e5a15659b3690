"""What a function does with the node that it is given, told by its text.

The node is the first positional parameter, whatever its name. What cannot be told makes a kind of
use *open*: there may be further ones, by names that only running it would show.
"""

from __future__ import annotations

import ast
import builtins
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.python_source import find_texts

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from composer.python_source import FunctionNode

UseKind: TypeAlias = Literal['publisher', 'service client', 'action client', 'parameter']

ALL_KINDS: frozenset[UseKind] = frozenset(
    ('publisher', 'service client', 'action client', 'parameter')
)
_METHODS: dict[str, UseKind] = {
    'publish': 'publisher',
    'call': 'service client',
    'call_async': 'service client',
    'send_goal': 'action client',
}
# Attributes of `composer.Node` through which nothing that a file declares is reached by name.
_HARMLESS = {'name', 'logger', 'now', 'state', 'own_state', 'shutdown', 'set_parameters'}
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
# What a mapping has itself, so that `node.parameters.get` is no parameter.
_OF_MAPPINGS = {'get', 'items', 'keys', 'values'}
_JUMPS = (ast.Return, ast.Raise, ast.Continue, ast.Break)


@dataclass(frozen=True, slots=True)
class NodeUse:
    """One use of something by a literal name, as in `node.publish('status', …)`.

    Attributes:
        line: Of the name, counted from 1; `column` likewise.
        length: Of what stands for the name there: itself, or that of a constant.
        is_optional: Whether it copes without: `node.parameters.get('x')`.
        has_default: Whether it brings a value for that case.
        is_certain: Whether it hangs on nothing that a file can decide: on parameters, the node's
            name, or arguments of `with:`.
        is_guarded: Whether an error that it raises is caught.
        waits: Whether the function itself waits for the answer.
    """

    kind: UseKind
    name: str
    line: int
    column: int
    length: int
    is_optional: bool = False
    has_default: bool = False
    is_certain: bool = True
    is_guarded: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class NodePass:
    """The node is given to a function of the module: `helper(node)`.

    Attributes:
        position: Of the node among the arguments, or the keyword that it is given by.
        is_awaited: Whether a coroutine that it returns is run here.

    The others are as in `NodeUse`, and hold for all that the function does.
    """

    function: str
    position: int | str
    is_certain: bool
    is_guarded: bool
    is_awaited: bool
    waits: bool


@dataclass(frozen=True, slots=True)
class NodeUses:
    """All that a function does with the node.

    Attributes:
        open_kinds: Of what it may use more than `uses` says.
        reads_others: Whether it reads parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
    """

    uses: tuple[NodeUse, ...] = ()
    passes: tuple[NodePass, ...] = ()
    open_kinds: frozenset[UseKind] = ALL_KINDS
    reads_others: bool = False
    reaches_ros: bool = False


def read_node_uses(
    function: FunctionNode,
    node_name: str,
    given: Iterable[str],
    texts: Mapping[str, str] = MappingProxyType({}),
) -> NodeUses:
    """Return what a function does with its parameter `node_name`.

    Args:
        given: The parameters whose values no file decides: the node itself, a message.
        texts: The names outside of the function that are a text for good.
    """
    parameters = {argument.arg for argument in _arguments(function.args)}
    stored = {name.id for name in _stored_names(function)}
    if node_name in stored:
        return NodeUses()
    local = parameters | stored | _nested_names(function)
    chosen = _find_chosen(function, node_name, parameters - set(given))
    known = {name: text for name, text in texts.items() if name not in local}
    known |= {n: text for n, text in find_texts(function.body).items() if n not in parameters}
    reader = _UseReader(node_name, local, chosen, known, _find_run(function))
    for statement in function.body:
        reader.visit(statement)
    return NodeUses(
        tuple(reader.uses),
        tuple(reader.passes),
        frozenset(reader.open_kinds),
        reader.reads_others,
        reader.reaches_ros,
    )


def find_parameter(function: FunctionNode, position: int | str) -> str | None:
    """Return the name of a parameter by its position or keyword."""
    arguments = function.args
    positional = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
    if isinstance(position, int):
        return positional[position] if position < len(positional) else None
    named = [argument.arg for argument in (*arguments.args, *arguments.kwonlyargs)]
    return position if position in named else None


def _arguments(arguments: ast.arguments) -> Iterator[ast.arg]:
    yield from (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    yield from filter(None, (arguments.vararg, arguments.kwarg))


def _stored_names(function: FunctionNode) -> Iterator[ast.Name]:
    for statement in function.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
                yield node


def _nested_names(function: FunctionNode) -> set[str]:
    names: set[str] = set()
    for statement in function.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                names.add(node.name)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                names |= {(item.asname or item.name).partition('.')[0] for item in node.names}
            elif isinstance(node, ast.ExceptHandler) and node.name:
                names.add(node.name)
    return names


def _find_chosen(function: FunctionNode, node_name: str, chosen: set[str]) -> set[str]:
    """Return the names whose values a file decides, those computed from others included."""
    found = set(chosen)
    pairs = [pair for statement in function.body for pair in _assignments(statement)]
    while True:
        before = len(found)
        for target, value in pairs:
            if _hangs_on(value, node_name, found):
                found |= {name.id for name in ast.walk(target) if isinstance(name, ast.Name)}
        if len(found) == before:
            return found


def _assignments(statement: ast.stmt) -> Iterator[tuple[ast.expr, ast.expr]]:
    for node in ast.walk(statement):
        if isinstance(node, ast.Assign):
            yield from ((target, node.value) for target in node.targets)
        elif isinstance(node, ast.AnnAssign | ast.AugAssign | ast.NamedExpr):
            if node.value is not None:
                yield node.target, node.value
        elif isinstance(node, ast.For | ast.AsyncFor | ast.comprehension):
            yield node.target, node.iter
        elif isinstance(node, ast.withitem) and node.optional_vars is not None:
            yield node.optional_vars, node.context_expr


def _hangs_on(expression: ast.expr, node_name: str, chosen: set[str]) -> bool:
    for node in ast.walk(expression):
        if isinstance(node, ast.Name) and node.id in chosen:
            return True
        is_of_node = isinstance(node, ast.Attribute) and _is_name(node.value, node_name)
        if is_of_node and node.attr in ('name', 'parameters', 'ros'):  # type: ignore[attr-defined]
            return True
    return False


def _is_name(node: ast.AST, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def _find_run(function: FunctionNode) -> set[str]:
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


class _UseReader(ast.NodeVisitor):
    """Walks a function's body with what is known of the way to each place."""

    def __init__(
        self,
        node_name: str,
        local: set[str],
        chosen: set[str],
        texts: Mapping[str, str],
        run: Collection[str],
    ) -> None:
        self.uses: list[NodeUse] = []
        self.passes: list[NodePass] = []
        self.open_kinds: set[UseKind] = set()
        self.reads_others = False
        self.reaches_ros = False
        self._node = node_name
        self._local = local
        self._chosen = chosen
        self._texts = texts
        self._run = run
        self._doubts = 0
        self._guards = 0
        self._depth = 0
        self._awaited: ast.AST | None = None

    def visit_Name(self, node: ast.Name) -> None:
        """Anything else than what the other methods know may do anything with the node."""
        if node.id == self._node:
            self.open_kinds |= ALL_KINDS

    def visit_Attribute(self, node: ast.Attribute) -> None:
        """`node.parameters.x`, and attributes that are not called."""
        if self._is_parameters(node.value):
            if isinstance(node.ctx, ast.Load) and node.attr not in _OF_MAPPINGS:
                self._use('parameter', node.attr, node)
            else:
                self.open_kinds.add('parameter')
        elif not _is_name(node.value, self._node):
            self.visit(node.value)
        elif node.attr in _METHODS:
            self.open_kinds.add(_METHODS[node.attr])
        elif node.attr in ('parameters', 'ros'):
            self.open_kinds.add('parameter')
            self.reaches_ros |= node.attr == 'ros'
        elif node.attr == 'get_parameters':
            self.reads_others = True
        elif node.attr not in _HARMLESS:
            self.open_kinds |= ALL_KINDS

    def visit_Subscript(self, node: ast.Subscript) -> None:
        """`node.parameters['x']`."""
        name = self._text(node.slice)
        if name is not None and self._is_parameters(node.value) and _is_load(node):
            self._use('parameter', name, node.slice)
        else:
            self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        """`'x' in node.parameters` uses it, and copes without."""
        name = self._text(node.left)
        if name is not None and len(node.ops) == 1 and self._is_parameters(node.comparators[0]):
            self._use('parameter', name, node.left, is_optional=True, has_default=True)
        else:
            self.generic_visit(node)

    def visit_Await(self, node: ast.Await) -> None:
        """What is awaited is waited for."""
        self._awaited = node.value
        self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        """`node.publish('x', …)` and the like, `node.parameters.get('x')`, `helper(node)`."""
        function = node.func
        if isinstance(function, ast.Attribute) and _is_name(function.value, self._node):
            self._visit_method(node, function)
        elif (
            isinstance(function, ast.Attribute)
            and function.attr == 'get'
            and self._is_parameters(function.value)
        ):
            self._visit_get(node)
        elif isinstance(function, ast.Name) and function.id not in self._local:
            self._visit_pass(node, function.id)
        else:
            self.generic_visit(node)

    def _visit_method(self, node: ast.Call, function: ast.Attribute) -> None:
        kind = _METHODS.get(function.attr)
        arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
        if kind is None:
            self.visit_Attribute(function)
        else:
            by_keyword = [each.value for each in node.keywords if each.arg == 'name']
            named = next(iter([*node.args, *by_keyword]), None)
            name = self._text(named)
            if name is None or named is None:
                self.open_kinds.add(kind)
            else:
                waits = function.attr != 'call_async' or self._awaited is node
                self._use(kind, name, named, waits=waits)
                arguments.remove(named)
        for argument in arguments:
            self.visit(argument)

    def _visit_get(self, node: ast.Call) -> None:
        name = self._text(node.args[0]) if node.args else None
        if name is None:
            self.open_kinds.add('parameter')
        else:
            has_default = len(node.args) + len(node.keywords) > 1
            self._use('parameter', name, node.args[0], is_optional=True, has_default=has_default)
        for argument in (*node.args[1:], *(keyword.value for keyword in node.keywords)):
            self.visit(argument)

    def _visit_pass(self, node: ast.Call, function: str) -> None:
        places: list[tuple[int | str, ast.expr]] = list(enumerate(node.args))
        places += [(each.arg or '', each.value) for each in node.keywords]
        # Behind `*arguments` no position is known.
        is_plain = not any(isinstance(argument, ast.Starred) for argument in node.args)
        may_be_helper = is_plain and not hasattr(builtins, function)
        for position, value in places:
            if may_be_helper and position != '' and _is_name(value, self._node):
                self.passes.append(
                    NodePass(
                        function,
                        position,
                        is_certain=not self._doubts,
                        is_guarded=bool(self._guards),
                        is_awaited=self._awaited is node,
                        waits=not self._depth,
                    )
                )
            else:
                self.visit(value)

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
        self._doubts += _hangs_on(node.test, self._node, self._chosen)

    def visit_Try(self, node: ast.Try) -> None:
        """Its body is guarded if a handler catches what an unknown name raises."""
        is_guard = any(_catches(handler) for handler in node.handlers)
        self._guards += is_guard
        for statement in node.body:
            self.visit(statement)
        self._guards -= is_guard
        for inner in (*node.handlers, *node.orelse, *node.finalbody):
            self.visit(inner)

    def visit_With(self, node: ast.With) -> None:
        """`suppress` is a guard."""
        is_guard = any('suppress' in ast.dump(item.context_expr) for item in node.items)
        self._guards += is_guard
        self.generic_visit(node)
        self._guards -= is_guard

    def _visit_choice(
        self, test: ast.expr, branches: Iterable[ast.AST], *, is_loop: bool = False
    ) -> None:
        self.visit(test)
        is_chosen = _hangs_on(test, self._node, self._chosen)
        is_chosen |= not is_loop and self._is_constant(test)
        self._doubts += is_chosen
        inner = list(branches)
        for branch in inner:
            self.visit(branch)
        jumps = any(isinstance(node, _JUMPS) for branch in inner for node in ast.walk(branch))
        if is_chosen and not jumps:
            self._doubts -= 1

    def _is_constant(self, test: ast.expr) -> bool:
        """Return whether a test hangs on nothing of the function: on a constant, say."""
        if isinstance(test, ast.Constant):
            return not test.value
        names = {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
        return not names & self._local

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """A function inside runs when it is called, if ever."""
        self._visit_nested(node, node.args, node.body, runs=node.name in self._run)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        """See `visit_FunctionDef`."""
        self._visit_nested(node, node.args, node.body, runs=node.name in self._run)

    def visit_Lambda(self, node: ast.Lambda) -> None:
        """See `visit_FunctionDef`."""
        self._visit_nested(node, node.args, [node.body])

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
        if any(argument.arg == self._node for argument in _arguments(arguments)):
            return
        self._depth += not runs
        for inner in body:
            self.visit(inner)
        self._depth -= not runs

    def _text(self, node: ast.expr | None) -> str | None:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            return node.value
        return self._texts.get(node.id) if isinstance(node, ast.Name) else None

    def _is_parameters(self, node: ast.expr) -> bool:
        return (
            isinstance(node, ast.Attribute)
            and node.attr == 'parameters'
            and _is_name(node.value, self._node)
        )

    def _use(
        self,
        kind: UseKind,
        name: str,
        at: ast.expr,
        *,
        is_optional: bool = False,
        has_default: bool = False,
        waits: bool = False,
    ) -> None:
        end = at.end_col_offset or 0
        length = len(at.id) if isinstance(at, ast.Name) else len(name)
        is_bare = isinstance(at, ast.Attribute | ast.Name)
        line, column = at.end_lineno or 1, end - length + is_bare
        self.uses.append(
            NodeUse(
                kind,
                name,
                line,
                column,
                length,
                is_optional=is_optional,
                has_default=has_default,
                is_certain=not self._doubts,
                is_guarded=bool(self._guards),
                waits=waits and not self._depth,
            )
        )


def _is_load(node: ast.Subscript) -> bool:
    return isinstance(node.ctx, ast.Load)


def _catches(handler: ast.ExceptHandler) -> bool:
    if handler.type is None:
        return True
    caught = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    names = {
        each.attr if isinstance(each, ast.Attribute) else getattr(each, 'id', None)
        for each in caught
    }
    return bool(names & (_CATCHING | {None}))
