"""Read what a function does with its node, without running it.

The node is one of the parameters, whatever its name. If a use has no literal name, its kind is
*open*: the function may use more entities of that kind.
"""

from __future__ import annotations

import ast
import builtins
from types import MappingProxyType
from typing import TYPE_CHECKING

from composer.python_source.control_flow import ControlFlowVisitor, find_inner_calls
from composer.python_source.local_names import (
    find_chosen,
    is_name,
    list_arguments,
    nested_names,
    stored_names,
)
from composer.python_source.modules import find_texts
from composer.python_source.node_uses import USED_NOUNS, NodePass, NodeUse, NodeUses

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from composer.python_source.syntax import FunctionNode

# Methods of `composer.Node`, and the kind of entity whose name is their first argument.
_METHODS = {
    'publish': 'publisher',
    'call': 'service client',
    'call_async': 'service client',
    'send_goal': 'action client',
}
# Attributes of `composer.Node` that use no declared entity.
_HARMLESS = {'name', 'logger', 'now', 'state', 'own_state', 'shutdown', 'set_parameters'}
# Methods of a mapping: `node.parameters.get` is no parameter.
_MAPPING_METHODS = {'get', 'items', 'keys', 'values'}


def read_node_uses(
    function: FunctionNode,
    node_name: str,
    given: Iterable[str],
    texts: Mapping[str, str] = MappingProxyType({}),
) -> NodeUses:
    """Return what a function does with its parameter `node_name`.

    Args:
        given: The parameters whose values no file sets: the node itself, a message.
        texts: The constants outside of the function that are texts.
    """
    nodes = [node for statement in function.body for node in ast.walk(statement)]
    parameters = {argument.arg for argument in list_arguments(function.args)}
    stored = {name.id for name in stored_names(nodes)}
    if node_name in stored:
        return NodeUses()
    local = parameters | stored | nested_names(nodes)
    chosen = find_chosen(nodes, node_name, parameters - set(given))
    known = {name: text for name, text in texts.items() if name not in local}
    known |= {
        n: text for n, text in find_texts(function.body, nodes).items() if n not in parameters
    }
    reader = _UseVisitor(node_name, local, chosen, find_inner_calls(function), known)
    reader.visit_all(function.body)
    return NodeUses(
        tuple(reader.uses),
        tuple(reader.passes),
        frozenset(reader.open_kinds),
        reader.reads_others,
        reader.reaches_ros,
    )


class _UseVisitor(ControlFlowVisitor):
    """Collects the uses of the node.

    Args:
        texts: The constants that are texts, as `find_texts` returns them.

    The others are as in `ControlFlowVisitor`.
    """

    def __init__(
        self,
        node_name: str,
        local: set[str],
        chosen: set[str],
        run: Collection[str],
        texts: Mapping[str, str],
    ) -> None:
        super().__init__(node_name, local, chosen, run)
        self._texts = texts
        self.uses: list[NodeUse] = []
        self.passes: list[NodePass] = []
        self.open_kinds: set[str] = set()
        self.reads_others = False
        self.reaches_ros = False
        self._awaited: ast.AST | None = None

    def visit_Name(self, node: ast.Name) -> None:
        """Any other expression may do anything with the node."""
        if node.id == self.node_name:
            self.open_kinds |= USED_NOUNS

    def visit_Attribute(self, node: ast.Attribute) -> Iterator[ast.AST]:
        """`node.parameters.x`, and attributes that are not called."""
        if self._is_parameters(node.value):
            if isinstance(node.ctx, ast.Load) and node.attr not in _MAPPING_METHODS:
                self._use('parameter', node.attr, node)
            else:
                self.open_kinds.add('parameter')
        elif not is_name(node.value, self.node_name):
            yield node.value
        elif node.attr in _METHODS:
            self.open_kinds.add(_METHODS[node.attr])
        elif node.attr in ('parameters', 'ros'):
            self.open_kinds.add('parameter')
            self.reaches_ros |= node.attr == 'ros'
        elif node.attr == 'get_parameters':
            self.reads_others = True
        elif node.attr not in _HARMLESS:
            self.open_kinds |= USED_NOUNS

    def visit_Subscript(self, node: ast.Subscript) -> Iterator[ast.AST]:
        """`node.parameters['x']`."""
        name = self._text(node.slice)
        if name is not None and self._is_parameters(node.value) and _is_load(node):
            self._use('parameter', name, node.slice)
        else:
            yield from ast.iter_child_nodes(node)

    def visit_Compare(self, node: ast.Compare) -> Iterator[ast.AST]:
        """`'x' in node.parameters` uses it, and works without it."""
        name = self._text(node.left)
        if name is not None and len(node.ops) == 1 and self._is_parameters(node.comparators[0]):
            self._use('parameter', name, node.left, is_optional=True, has_default=True)
        else:
            yield from ast.iter_child_nodes(node)

    def visit_Await(self, node: ast.Await) -> Iterator[ast.AST]:
        """The function waits for what it awaits."""
        self._awaited = node.value
        yield node.value

    def visit_Call(self, node: ast.Call) -> Iterator[ast.AST]:
        """`node.publish('x', …)` and the like, `node.parameters.get('x')`, `helper(node)`."""
        function = node.func
        if isinstance(function, ast.Attribute) and is_name(function.value, self.node_name):
            yield from self._visit_method(node, function)
        elif (
            isinstance(function, ast.Attribute)
            and function.attr == 'get'
            and self._is_parameters(function.value)
        ):
            yield from self._visit_get(node)
        elif isinstance(function, ast.Name) and function.id not in self.local:
            yield from self._visit_pass(node, function.id)
        else:
            yield from ast.iter_child_nodes(node)

    def _visit_method(self, node: ast.Call, function: ast.Attribute) -> Iterator[ast.AST]:
        kind = _METHODS.get(function.attr)
        arguments = [*node.args, *(keyword.value for keyword in node.keywords)]
        if kind is None:
            yield function
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
        yield from arguments

    def _visit_get(self, node: ast.Call) -> Iterator[ast.AST]:
        name = self._text(node.args[0]) if node.args else None
        if name is None:
            self.open_kinds.add('parameter')
        else:
            has_default = len(node.args) + len(node.keywords) > 1
            self._use('parameter', name, node.args[0], is_optional=True, has_default=has_default)
        yield from (*node.args[1:], *(keyword.value for keyword in node.keywords))

    def _visit_pass(self, node: ast.Call, function: str) -> Iterator[ast.AST]:
        places: list[tuple[int | str, ast.expr]] = list(enumerate(node.args))
        places += [(each.arg or '', each.value) for each in node.keywords]
        # After `*arguments`, positions are unknown.
        is_plain = not any(isinstance(argument, ast.Starred) for argument in node.args)
        may_be_helper = is_plain and not hasattr(builtins, function)
        for position, value in places:
            if may_be_helper and position != '' and is_name(value, self.node_name):
                self.passes.append(
                    NodePass(
                        function,
                        position,
                        is_certain=not self.doubts,
                        is_guarded=bool(self.guards),
                        is_awaited=self._awaited is node,
                        waits=not self.depth,
                    )
                )
            else:
                yield value

    def _text(self, node: ast.expr | None) -> str | None:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            return node.value
        return self._texts.get(node.id) if isinstance(node, ast.Name) else None

    def _is_parameters(self, node: ast.expr) -> bool:
        return (
            isinstance(node, ast.Attribute)
            and node.attr == 'parameters'
            and is_name(node.value, self.node_name)
        )

    def _use(
        self,
        kind: str,
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
                is_certain=not self.doubts,
                is_guarded=bool(self.guards),
                waits=waits and not self.depth,
            )
        )


def _is_load(node: ast.Subscript) -> bool:
    return isinstance(node.ctx, ast.Load)
