"""The names that the behaviours of a node set in `node.state`, as their modules show them."""

from __future__ import annotations

import ast

# Whoever uses these may set names that no check can see.
_OPEN = frozenset({'__dict__', 'vars'})


def find_stored_names(tree: ast.Module) -> frozenset[str] | None:
    """Return every name that a module sets as an attribute of anything.

    It need not be `node.state` itself that it names: that may be passed on, or have another name.

    Returns:
        None if it may set names that are not written out.
    """
    names: set[str] = set()
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
            names.add(node.attr)
        elif isinstance(node, ast.Attribute | ast.Name) and (
            _name_of(node) in _OPEN or (_name_of(node) == 'setattr' and id(node) not in called)
        ):
            return None
        elif isinstance(node, ast.Call) and _name_of(node.func) == 'setattr':
            name = node.args[1] if len(node.args) > 1 else None
            if not (isinstance(name, ast.Constant) and isinstance(name.value, str)):
                return None
            names.add(name.value)
    return frozenset(names)


def _name_of(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ''
