"""What code may use that no reading followed, such as methods that are called by unknown ways.

Nothing is reported in it; what it may use is not called unused.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.node_uses.reading import SENDING_METHODS, USED_NOUNS
from composer.python_source.syntax import list_children

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from composer.python_source.modules import ModuleSource

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)


@dataclass(slots=True)
class Mentions:
    """What code may use.

    Attributes:
        names: The names that it may use, of whatever kind.
        open_kinds: The kinds of which it may use any.
        attributes: Attributes of something that it names, and globals that it stores.
    """

    names: set[str] = field(default_factory=set)
    open_kinds: set[str] = field(default_factory=set)
    attributes: set[str] = field(default_factory=set)


def find_mentions(module: ModuleSource, followed: Collection[int]) -> Mentions:
    """Return what the code of a module may use that was not followed.

    Args:
        followed: The functions that were, by their syntax trees.
    """
    found = Mentions()
    plain: set[int] = set()
    for node in _unread(module, followed):
        if isinstance(node, ast.Attribute):
            found.attributes.add(node.attr)
        elif isinstance(node, ast.Global):
            found.attributes.update(node.names)
        match node:
            case ast.Constant(value=str(text)):
                found.names.add(text)
            case ast.Attribute(value=ast.Attribute(attr='parameters') as parameters, attr=name):
                plain.add(id(parameters))
                found.names.add(name)
            case ast.Subscript(
                value=ast.Attribute(attr='parameters') as parameters, slice=ast.Constant()
            ):
                plain.add(id(parameters))
            case ast.Attribute(attr='parameters') if id(node) not in plain:
                found.open_kinds.add('parameter')
            case ast.Call(func=ast.Attribute(attr=method), args=[name, *_]) if (
                method in SENDING_METHODS
            ):
                if not isinstance(name, ast.Constant):
                    found.open_kinds.add(SENDING_METHODS[method])
            case ast.Call(func=ast.Name('exec' | 'eval')):
                found.open_kinds |= USED_NOUNS
    return found


def _unread(module: ModuleSource, followed: Collection[int]) -> Iterator[ast.AST]:
    """Yield the nodes of classes and of functions that were not followed."""
    pending: list[tuple[ast.AST, bool]] = [(each, False) for each in module.body]
    while pending:
        node, is_unread = pending.pop()
        if isinstance(node, _FUNCTIONS):
            is_unread = id(node) not in followed
        elif isinstance(node, ast.ClassDef):
            is_unread = True
        if is_unread:
            yield node
        pending += [(each, is_unread) for each in list_children(node)]
