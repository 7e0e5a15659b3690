"""`PythonExpression` → an expression of the language, where the two mean the same."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING

from composer.launch_files.texts import Code, Kind, Text, constant, one

if TYPE_CHECKING:
    from collections.abc import Mapping

_NAME = re.compile(r'(__part_\d+__)')
# What both languages write alike, and take for the same.
_ALIKE = (
    *(ast.Compare, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.IfExp, ast.List, ast.Load),
    *(ast.And, ast.Or, ast.Not, ast.USub, ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
    *(ast.In, ast.NotIn, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod, ast.Pow),
)
_METHODS = ('lower', 'upper', 'strip', 'startswith', 'endswith')


class UnlikeError(Exception):
    """There is no such expression in the language."""


def translate(source: Text, result: str) -> Text:
    """Return the value of Python source as an expression; a constant if there is none.

    Args:
        result: Its value as a text, with the arguments as they are given to the import.

    Raises:
        UnlikeError: It depends on arguments, and means nothing in the language.
    """
    names = [
        part if isinstance(part, str) else f'__part_{i}__' for i, part in enumerate(source.parts)
    ]
    parts = {
        name: part
        for name, part in zip(names, source.parts, strict=True)
        if isinstance(part, Code)
    }
    if not parts:
        return constant(result)
    try:
        tree = ast.parse(''.join(names).strip(), mode='eval')
    except SyntaxError as error:
        raise UnlikeError from error
    code = ast.unparse(_Translator(parts).visit(tree.body))
    return one(f'({code})', result, _kind_of(result))


def _kind_of(result: str) -> Kind:
    if result in ('True', 'False'):
        return 'python-bool'
    return 'number' if re.fullmatch(r'-?\d+(\.\d+)?', result) else 'text'


class _Translator(ast.NodeTransformer):
    """Puts the expressions of arguments in the place of their names."""

    def __init__(self, parts: Mapping[str, Code]) -> None:
        self._parts = parts

    def visit_Name(self, node: ast.Name) -> ast.expr:
        part = self._parts.get(node.id)
        if part is None:
            raise UnlikeError
        # Bare, it is Python itself: a number or `True`.
        return ast.Name(part.code if part.kind != 'text' else f'({part.code} | from_yaml)')

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if not isinstance(node.value, str):
            return node
        pieces = (self._parts.get(piece, piece) for piece in _NAME.split(node.value) if piece)
        return ast.Name(Text(tuple(pieces)).code)

    def visit_Tuple(self, node: ast.Tuple) -> ast.expr:
        return ast.List([self.visit(item) for item in node.elts], ast.Load())

    def visit_Call(self, node: ast.Call) -> ast.expr:
        function = node.func
        if (
            not isinstance(function, ast.Attribute)
            or function.attr not in _METHODS
            or node.keywords
        ):
            raise UnlikeError
        function.value = self.visit(function.value)
        node.args = [self.visit(argument) for argument in node.args]
        return node

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if not isinstance(node, _ALIKE):
            raise UnlikeError
        return super().generic_visit(node)
