"""Where the code of a module stores attributes: whether one is what it was made with."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.syntax import list_children
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

# Stands for the names of attributes that are not written out.
ANY = '*'
# Methods that change what they are called on.
CHANGING = frozenset(
    {
        *('add', 'append', 'appendleft', 'clear', 'discard', 'extend', 'insert', 'pop', 'popitem'),
        *('popleft', 'remove', 'reverse', 'setdefault', 'sort', 'update'),
    }
)
# Methods in which an object is made.
_MAKING = frozenset({'__init__', '__new__', '__post_init__', '__set_name__'})
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@record
class AttributeStore:
    """A place that stores an attribute.

    Attributes:
        owner: The class whose method stores it in its first parameter; `None` for other stores.
        is_made: Whether that is done while the object is made.
        is_inside: Whether it changes what the attribute holds: a list, a dictionary.
    """

    owner: ast.ClassDef | None
    is_made: bool
    is_inside: bool = False


def find_stores(body: Iterable[ast.stmt]) -> dict[str, list[AttributeStore]]:
    """Return the places that store attributes, by the names of these."""
    found: dict[str, list[AttributeStore]] = {}
    for node, owner, method in _walk(body):
        is_inside = False
        match node:
            case ast.Attribute(value=target, attr=name) if not isinstance(node.ctx, ast.Load):
                known = owner if _is_first(target, method) else None
            case ast.Call(func=ast.Name('setattr'), args=[target, ast.Constant(str(name)), _]):
                known = owner if _is_first(target, method) else None
            case ast.Call(func=ast.Name('setattr'), args=[target, _, _]):
                name, known = ANY, owner if _is_first(target, method) else None
            case ast.Subscript(value=ast.Attribute(value=target, attr=name)):
                if isinstance(node.ctx, ast.Load):
                    continue
                known, is_inside = owner if _is_first(target, method) else None, True
            case ast.Call(func=ast.Attribute(value=ast.Attribute(value=target, attr=name))):
                if node.func.attr not in CHANGING:  # type: ignore[attr-defined]
                    continue
                known, is_inside = owner if _is_first(target, method) else None, True
            case _:
                continue
        is_made = known is not None and method is not None and method.name in _MAKING
        found.setdefault(name, []).append(AttributeStore(known, is_made, is_inside))
    return found


_Method = ast.FunctionDef | ast.AsyncFunctionDef | None


def _walk(body: Iterable[ast.stmt]) -> Iterator[tuple[ast.AST, ast.ClassDef | None, _Method]]:
    """Yield all nodes, and the class and the method of it that they are in."""
    pending: list[tuple[ast.AST, ast.ClassDef | None, _Method]] = [
        (each, None, None) for each in body
    ]
    while pending:
        node, owner, method = pending.pop()
        yield node, owner, method
        if isinstance(node, ast.ClassDef):
            owner, method = node, None
        elif isinstance(node, _FUNCTIONS) and method is None:
            method = node
        pending += [(each, owner, method) for each in list_children(node)]


def _is_first(target: ast.expr, method: _Method) -> bool:
    """Return whether an expression is the object of a method."""
    if method is None or not isinstance(target, ast.Name):
        return False
    if {ast.unparse(each) for each in method.decorator_list} & {'classmethod', 'staticmethod'}:
        return False
    first = [*method.args.posonlyargs, *method.args.args][:1]
    return [each.arg for each in first] == [target.id]
