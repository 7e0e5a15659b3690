"""The names at the top of a module, and the statements that store them."""

from __future__ import annotations

import ast
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

from composer.python_source.local_names import list_arguments
from composer.python_source.syntax import BLOCKS, list_children, list_nodes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_BINDING = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


class TopNames:
    """The names that the statements of a module store, each with whether on a condition.

    Attributes:
        is_open: Whether there may be others.
    """

    def __init__(self, body: Iterable[ast.stmt]) -> None:
        self.statements: dict[str, list[tuple[ast.AST, bool]]] = {}
        self.is_open = False
        self._body = list(body)
        pending: list[tuple[ast.AST, bool]] = [(each, False) for each in reversed(self._body)]
        while pending:
            statement, is_conditional = pending.pop()
            for name in self._stored(statement):
                self.statements.setdefault(name, []).append((statement, is_conditional))
            if not isinstance(statement, _BINDING):
                blocks = (getattr(statement, name, ()) for name in BLOCKS)
                pending += [(each, True) for block in blocks for each in block]

    def _stored(self, statement: ast.AST) -> Iterator[str]:
        if isinstance(statement, _BINDING):
            yield statement.name
            self.is_open |= statement.name == '__getattr__'
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            for alias in statement.names:
                self.is_open |= alias.name == '*'
                yield alias.asname or alias.name.partition('.')[0]
        elif isinstance(statement, ast.ExceptHandler):
            yield from filter(None, [statement.name])
        elif not isinstance(statement, ast.match_case):
            for node in _own(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    yield node.id

    @cached_property
    def is_dynamic(self) -> bool:
        """Whether code may store any name: `globals()['x'] = 1`, `exec`, `sys.modules`."""
        return any(map(_may_store_any, self._nodes))

    @cached_property
    def stored_again(self) -> frozenset[str]:
        """Names that functions store, and those of which items are stored."""
        found: set[str] = set()
        for node in self._nodes:
            match node:
                case ast.Global(names=names):
                    found |= set(names)
                case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store() | ast.Del()):
                    found.add(name)
                case ast.AugAssign(target=ast.Name(id=name)):
                    found.add(name)
        return frozenset(found)

    @cached_property
    def patched(self) -> frozenset[str]:
        """Names of attributes that the module itself stores in something, and `setattr` does."""
        found: set[str] = set()
        for node in list_nodes([each for each in self._body if not isinstance(each, _BINDING)]):
            match node:
                case ast.Attribute(attr=name, ctx=ast.Store()):
                    found.add(name)
                case ast.Call(func=ast.Name('setattr'), args=[_, ast.Constant(str(name)), _]):
                    found.add(name)
        return frozenset(found)

    @cached_property
    def stored_attributes(self) -> Counter[str]:
        """How often code stores attributes, by their names; empty for one that is computed."""
        found: Counter[str] = Counter()
        for node in self._nodes:
            match node:
                case ast.Attribute(attr='__dict__' | '__setattr__') | ast.Name(id='vars'):
                    found[''] += 1
                case ast.Attribute(attr=name, ctx=ast.Store()):
                    found[name] += 1
                case ast.Call(func=ast.Name('setattr'), args=[_, ast.Constant(str(name)), _]):
                    found[name] += 2
                case ast.Call(func=ast.Name('setattr'), args=[ast.Name(), *_]):
                    found[''] += 1
        return found

    @cached_property
    def all_stored(self) -> frozenset[str]:
        """All names that the code of the module stores anywhere."""
        found: set[str] = set(self.statements)
        for node in self._nodes:
            match node:
                case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
                    found.add(name)
                case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.Lambda():
                    found.update(each.arg for each in list_arguments(node.args))
                    found.add(getattr(node, 'name', ''))
                case ast.ClassDef(name=name) | ast.ExceptHandler(name=str(name)):
                    found.add(name)
                case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                    found.add(name)
                case ast.MatchMapping(rest=str(name)):
                    found.add(name)
                case ast.Import(names=aliases) | ast.ImportFrom(names=aliases):
                    found |= {each.asname or each.name.partition('.')[0] for each in aliases}
                case ast.Global(names=names):
                    found |= set(names)
        return frozenset(found)

    @cached_property
    def _nodes(self) -> list[ast.AST]:
        return list_nodes(self._body)


def _may_store_any(node: ast.AST) -> bool:
    match node:
        case ast.Call(func=ast.Name('exec' | 'eval' | 'globals' | 'locals' | 'vars')):
            return True
        case ast.Attribute(attr='modules' | '__dict__') | ast.alias(name='modules'):
            return True
        case ast.Call(func=ast.Name('setattr'), args=[ast.Name(), key, _]):
            return not isinstance(key, ast.Constant)
    return False


def _own(statement: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a statement without those of the statements in it."""
    pending: list[ast.AST] = [statement]
    while pending:
        node = pending.pop()
        yield node
        pending += [
            each
            for each in list_children(node)
            if not isinstance(
                each, ast.stmt | ast.ExceptHandler | ast.match_case | ast.comprehension
            )
        ]
