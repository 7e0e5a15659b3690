"""The names that the behaviours of a node set in `node.state`, as their modules show them."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

# Whoever uses these may set names that no check can see.
_OPEN = frozenset({'__dict__', 'vars'})
_ANYTHING = 'Any'
# The methods of a node that return what has a type of its own.
_RETURNED = {'now': 'Time'}
_ARITHMETIC = (ast.Add, ast.Sub, ast.Mult, ast.Div)
_NUMBERS = frozenset({'int', 'float'})


def find_stored_names(tree: ast.Module, module: str) -> dict[str, frozenset[str]] | None:
    """Return every name that a module sets as an attribute of anything, with the types of values.

    A class of the module itself is shown as `module:Class`.

    It need not be `node.state` itself that it names: that may be passed on, or have another name.

    Returns:
        None if it may set names that are not written out.
    """
    names: dict[str, set[str]] = {}
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    classes = [each.name for each in tree.body if isinstance(each, ast.ClassDef)]
    own = {name: f'{module}:{name}' for name in classes}
    values = dict(_assigned(tree, own))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
            names.setdefault(node.attr, set()).add(values.get(id(node), _ANYTHING))
        elif isinstance(node, ast.Attribute | ast.Name) and (
            _name_of(node) in _OPEN or (_name_of(node) == 'setattr' and id(node) not in called)
        ):
            return None
        elif isinstance(node, ast.Call) and _name_of(node.func) == 'setattr':
            name = node.args[1] if len(node.args) > 1 else None
            if not (isinstance(name, ast.Constant) and isinstance(name.value, str)):
                return None
            names.setdefault(name.value, set()).add(_ANYTHING)
    return {name: frozenset(types) for name, types in names.items()}


def type_of_state(value: object, stored: Iterable[Mapping[str, frozenset[str]]], name: str) -> str:
    """Return the type of a name of the state: of its value in the file, and of all that is stored.

    Args:
        value: The value in the file; `None` if there is none, as nothing is known of it.
    """
    types = {type(value).__name__}.union(*(names.get(name, frozenset()) for names in stored))
    if isinstance(value, float) and types <= {*_NUMBERS, '+=', 'NoneType', _ANYTHING}:
        # What the file declares as a number is one, whatever computes it.
        return 'float'
    if '+=' in types:
        # A number stays one, with whatever it is added to or multiplied by.
        types = types - {'+='} | ({'float'} if types & _NUMBERS else {_ANYTHING})
    types.discard('NoneType')
    if len(types) == 1 and ':' in ''.join(types):
        return types.pop()
    known = types <= {'bool', 'int', 'float', 'str', 'Time'}
    return ' | '.join(sorted(types)) if known and types else _ANYTHING


def _assigned(tree: ast.Module, own: Mapping[str, str]) -> Iterator[tuple[int, str]]:
    """Yield what is assigned to, and the type of its value."""
    # Arrays of NumPy turn what they are added to into an array.
    is_plain = not any(
        alias.name.partition('.')[0] == 'numpy'
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    )
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            yield from ((id(target), _type_of(node.value, own)) for target in node.targets)
        elif isinstance(node, ast.AugAssign) and is_plain and isinstance(node.op, _ARITHMETIC):
            yield id(node.target), '+='


def _type_of(value: ast.expr, own: Mapping[str, str]) -> str:
    match value:
        case ast.Call(func=ast.Name(id=name)) if name in own:
            return own[name]
        case ast.Constant():
            return type(value.value).__name__
        case ast.JoinedStr():
            return 'str'
        case ast.Compare(ops=[ast.Is() | ast.IsNot() | ast.In() | ast.NotIn(), *_]):
            return 'bool'
        case ast.Call(func=ast.Attribute(attr=method), args=[]) if method in _RETURNED:
            return _RETURNED[method]
    return _ANYTHING


def _name_of(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ''
