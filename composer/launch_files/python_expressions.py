"""`PythonExpression` → an expression of the language, where the two mean the same."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING

from composer.launch_files.texts import Code, Kind, Text, constant, one

if TYPE_CHECKING:
    from collections.abc import Iterator

_NAME = re.compile(r'(__part_\d+__)')
_OPERATORS: dict[type[ast.AST], str] = {
    ast.Eq: '==',
    ast.NotEq: '!=',
    ast.Lt: '<',
    ast.LtE: '<=',
    ast.Gt: '>',
    ast.GtE: '>=',
    ast.In: 'in',
    ast.NotIn: 'not in',
    ast.And: 'and',
    ast.Or: 'or',
    ast.Add: '+',
    ast.Sub: '-',
    ast.Mult: '*',
    ast.Div: '/',
    ast.FloorDiv: '//',
    ast.Mod: '%',
    ast.Pow: '**',
}
_METHODS = frozenset(
    ('lower', 'upper', 'strip', 'startswith', 'endswith', 'split', 'replace', 'lstrip', 'rstrip')
)


class UnlikeError(Exception):
    """There is no such expression in the language."""


def translate(source: Text, result: str) -> Text:
    """Return the value of Python source as an expression; a constant if there is none.

    Args:
        result: Its value as a text, with the arguments as they are given to the import.

    Raises:
        UnlikeError: It depends on arguments, and means nothing in the language.
    """
    parts: dict[str, Code] = {}
    plain = ''
    for part in source.parts:
        if isinstance(part, Code):
            name = f'__part_{len(parts)}__'
            parts[name] = part
            plain += name
        else:
            plain += part
    if not parts:
        return constant(result)
    try:
        tree = ast.parse(plain.strip(), mode='eval')
    except SyntaxError as error:
        raise UnlikeError from error
    return one(_Translator(parts).code(tree.body), result, _kind_of(result))


def _kind_of(result: str) -> Kind:
    if result in ('True', 'False'):
        return 'python-bool'
    return 'number' if re.fullmatch(r'-?\d+(\.\d+)?', result) else 'text'


class _Translator:
    def __init__(self, parts: dict[str, Code]) -> None:
        self._parts = parts

    def code(self, node: ast.expr) -> str:  # noqa: PLR0911 - one for each kind of node
        if isinstance(node, ast.Constant):
            return self._constant(node.value)
        if isinstance(node, ast.Name) and node.id in self._parts:
            part = self._parts[node.id]
            # Bare, it is Python itself: a number or `True`.
            return part.code if part.kind != 'text' else f'({part.code} | from_yaml)'
        if isinstance(node, ast.Compare):
            pairs = zip(node.ops, node.comparators, strict=True)
            compared = (f' {_operator(op)} {self.code(each)}' for op, each in pairs)
            return f'({self.code(node.left)}{"".join(compared)})'
        if isinstance(node, ast.BoolOp):
            return f'({f" {_operator(node.op)} ".join(map(self.code, node.values))})'
        if isinstance(node, ast.BinOp):
            return f'({self.code(node.left)} {_operator(node.op)} {self.code(node.right)})'
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            sign = 'not ' if isinstance(node.op, ast.Not) else '-'
            return f'({sign}{self.code(node.operand)})'
        if isinstance(node, ast.IfExp):
            return (
                f'({self.code(node.body)} if {self.code(node.test)} else {self.code(node.orelse)})'
            )
        if isinstance(node, ast.List | ast.Tuple):
            return f'[{", ".join(map(self.code, node.elts))}]'
        return self._method(node)

    def _method(self, node: ast.expr) -> str:
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr in _METHODS
            and not node.keywords
        ):
            arguments = ', '.join(map(self.code, node.args))
            return f'{self.code(node.func.value)}.{node.func.attr}({arguments})'
        raise UnlikeError

    def _constant(self, value: object) -> str:
        if isinstance(value, str):
            return Text(tuple(self._pieces(value))).code
        if isinstance(value, bool):
            return 'true' if value else 'false'
        if isinstance(value, int | float):
            return repr(value)
        raise UnlikeError

    def _pieces(self, value: str) -> Iterator[str | Code]:
        for piece in _NAME.split(value):
            if piece:
                yield self._parts.get(piece, piece)


def _operator(node: ast.AST) -> str:
    if type(node) not in _OPERATORS:
        raise UnlikeError
    return _OPERATORS[type(node)]
