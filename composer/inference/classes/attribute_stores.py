"""Where the code of a module stores attributes: whether one is what it was made with."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.python_source.changed_names import NOTHING, ChangedNames
from composer.python_source.syntax import list_children
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

# Stands for the names of attributes that are not written out.
ANY = '*'
# Methods in which an object is made.
_MAKING = frozenset({'__init__', '__new__', '__post_init__', '__set_name__'})
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@record
class AttributeStore:
    """A place that stores an attribute.

    Attributes:
        owner: The class whose method stores it in its first parameter; `None` for other stores.
        is_made: Whether that is done while the object is made.
        inside: How deep it changes what the attribute holds: a list, a dictionary.
    """

    owner: ast.ClassDef | None
    is_made: bool
    inside: int = NOTHING


def find_stores(
    body: Iterable[ast.stmt], changes: ChangedNames
) -> dict[str, list[AttributeStore]]:
    """Return the places that store attributes, or may do so, by the names of these."""
    found: dict[str, list[AttributeStore]] = {}
    for node, owner, method in _walk(body):
        inside, is_direct = NOTHING, True
        match node:
            case ast.Attribute(value=target, attr=name) if isinstance(node.ctx, ast.Load):
                inside, is_direct = changes.change_at(node), changes.is_changed_here(node)
                if name == '__setattr__' and isinstance(target, ast.Call):
                    name, target, inside = ANY, ast.Name(_first(method)), NOTHING
                elif inside == NOTHING:
                    continue
            case ast.Attribute(value=target, attr=name):
                pass
            case ast.Call(func=ast.Name('setattr'), args=[target, ast.Constant(str(name)), _]):
                pass
            case ast.Call(func=ast.Name('setattr'), args=[target, _, _]):
                name = ANY
            case ast.Name() as target if owner and _is_first(target, method):
                if not changes.is_given(target):
                    continue
                name, is_direct = ANY, False
            case _:
                continue
        known = owner if _is_first(target, method) else None
        is_made = known is not None and method is not None and method.name in _MAKING
        store = AttributeStore(known, is_made and is_direct, inside)
        found.setdefault(name, []).append(store)
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
    return isinstance(target, ast.Name) and bool(target.id) and target.id == _first(method)


def _first(method: _Method) -> str:
    """Return the name of the object of a method."""
    if method is None:
        return ''
    if {ast.unparse(each) for each in method.decorator_list} & {'classmethod', 'staticmethod'}:
        return ''
    first = [*method.args.posonlyargs, *method.args.args][:1]
    return first[0].arg if first else ''
